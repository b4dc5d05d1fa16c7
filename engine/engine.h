/* The engine's public face: everything that other folders may use. */
#ifndef LP_ENGINE_H
#define LP_ENGINE_H

#include "engine/base.h"
#include "engine/build.h"
#include "engine/cubemap.h"
#include "engine/executor.h"
#include "engine/image.h"
#include "engine/import.h"
#include "engine/octree.h"
#include "engine/render.h"
#include "engine/scene.h"
#include "engine/scene_file.h"
#include "engine/sha256.h"
#include "engine/srgb.h"
#include "engine/trace.h"

#endif
