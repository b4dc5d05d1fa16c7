// The thin shim around OpenImageIO: C interface outside, every exception caught inside.
#include "engine/image_oiio.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <mutex>
#include <new>
#include <string>
#include <vector>

struct lp_oiio_reader {
    std::unique_ptr<OIIO::ImageInput> input;
    std::string path;
    OIIO::TypeDesc type;
    int channels;
};

namespace
{

// Files carry this instead of the time they were written at.
constexpr char constant_time[] = "2000:01:01 00:00:00";
constexpr int side_max_px = 65535;
constexpr int channels_max = 4;

void set_up_once()
{
    static std::once_flag once;
    std::call_once(once, [] {
        OIIO::attribute("threads", 1);      // the caller's thread does the work
        OIIO::attribute("exr_threads", -1); // no pool in OpenEXR either
    });
}

void remove_all(std::string &text, const std::string &piece)
{
    for (size_t at; !piece.empty() && (at = text.find(piece)) != std::string::npos;)
        text.erase(at, piece.size());
}

// One line of the library's message, which may be many lines and name the path again.
std::string one_line(std::string message, const std::string &path)
{
    if (!path.empty()) {
        remove_all(message, " (\"" + path + "\")");
        remove_all(message, " \"" + path + "\"");
        remove_all(message, path + ": ");
    }
    size_t start = message.find_first_not_of(" \r\n\t");
    if (start == std::string::npos)
        return "no reason given";
    size_t end = message.find_first_of("\r\n", start);
    if (end == std::string::npos)
        end = message.size();
    while (end > start && (message[end - 1] == ' ' || message[end - 1] == '.'))
        end--;
    return message.substr(start, end - start);
}

// Turns whatever was thrown into a code. To be called from a catch block.
lp_code caught(const char *where, lp_error *err) noexcept
{
    try {
        throw;
    } catch (const std::bad_alloc &) {
        return lp_fail(err, LP_NO_MEMORY, where, "no memory for the picture; try a smaller one");
    } catch (const std::exception &e) {
        return lp_fail(err, LP_IO, where, "the image library failed: %s", e.what());
    } catch (...) {
        return lp_fail(err, LP_IO, where, "the image library failed without a reason");
    }
}

OIIO::TypeDesc library_type(lp_oiio_type type)
{
    switch (type) {
    case LP_OIIO_U8:
        return OIIO::TypeDesc::UINT8;
    case LP_OIIO_U16:
        return OIIO::TypeDesc::UINT16;
    case LP_OIIO_F32:
        break;
    }
    return OIIO::TypeDesc::FLOAT;
}

lp_code encode(uint8_t **out, size_t *out_bytes, const char *format, const lp_oiio_picture *picture,
               lp_error *err)
{
    set_up_once();
    OIIO::Filesystem::IOVecOutput memory; // declared first: it must outlive the output
    const std::string name = std::string("picture.") + format;
    std::unique_ptr<OIIO::ImageOutput> output = OIIO::ImageOutput::create(name);
    if (!output)
        return lp_fail(err, LP_IO, format, "this installation of OpenImageIO cannot write it: %s",
                       one_line(OIIO::geterror(), "").c_str());
    OIIO::ImageSpec spec(static_cast<int>(picture->width_px), static_cast<int>(picture->height_px),
                         3, library_type(picture->type));
    spec.attribute("oiio:ColorSpace", picture->srgb ? "sRGB" : "Linear");
    if (std::strcmp(format, "exr") == 0) {
        spec.attribute("DateTime", constant_time); // it would take the clock's
        spec.attribute("compression", "zip");      // 16 lines by deflate
    }
    bool ok = output->set_ioproxy(&memory) && output->open(name, spec) &&
              output->write_image(library_type(picture->type), picture->pixels);
    ok = output->close() && ok;
    if (!ok)
        return lp_fail(err, LP_IO, format, "encoding failed: %s",
                       one_line(output->geterror(), "").c_str());
    const std::vector<unsigned char> &bytes = memory.buffer();
    auto *copy = static_cast<uint8_t *>(std::malloc(bytes.size() ? bytes.size() : 1));
    if (!copy)
        throw std::bad_alloc();
    std::memcpy(copy, bytes.data(), bytes.size());
    *out = copy;
    *out_bytes = bytes.size();
    return LP_OK;
}

lp_code check_header(lp_oiio_header *header, lp_oiio_reader *reader, lp_error *err)
{
    const OIIO::ImageSpec &spec = reader->input->spec();
    const char *path = reader->path.c_str();
    if (spec.width < 1 || spec.height < 1 || spec.nchannels < 1)
        return lp_fail(err, LP_INVALID, path, "has no pixels (%d x %d, %d channels)", spec.width,
                       spec.height, spec.nchannels);
    if (spec.width > side_max_px || spec.height > side_max_px)
        return lp_fail(err, LP_LIMIT, path, "is %d x %d pixels; a side has at most %d: scale it",
                       spec.width, spec.height, side_max_px);
    if (spec.deep || spec.depth > 1)
        return lp_fail(err, LP_INVALID, path,
                       "is a deep or volume image; only flat pictures are read: flatten it");
    lp_oiio_header found = {static_cast<uint32_t>(spec.width), static_cast<uint32_t>(spec.height),
                            static_cast<uint32_t>(std::min(spec.nchannels, channels_max)),
                            LP_OIIO_F32};
    if (spec.format == OIIO::TypeDesc::UINT8)
        found.type = LP_OIIO_U8;
    else if (spec.format == OIIO::TypeDesc::UINT16)
        found.type = LP_OIIO_U16;
    else if (spec.format != OIIO::TypeDesc::FLOAT && spec.format != OIIO::TypeDesc::HALF)
        return lp_fail(err, LP_INVALID, path,
                       "has samples of type %s; read are integers of 8 or 16 bits without sign, "
                       "and floats of 16 or 32 bits: convert it",
                       spec.format.c_str());
    reader->type = library_type(found.type);
    reader->channels = static_cast<int>(found.channels);
    *header = found;
    return LP_OK;
}

lp_code open_reader(lp_oiio_reader **out, lp_oiio_header *header, const char *path, lp_error *err)
{
    set_up_once();
    auto reader = std::make_unique<lp_oiio_reader>();
    reader->path = path;
    OIIO::ImageSpec config;
    config.attribute("oiio:UnassociatedAlpha", 1); // the file's own samples, not alpha times them
    reader->input = OIIO::ImageInput::open(reader->path, &config);
    if (!reader->input)
        return lp_fail(err, LP_INVALID, path, "is not a picture that can be read: %s",
                       one_line(OIIO::geterror(), reader->path).c_str());
    lp_code code = check_header(header, reader.get(), err);
    if (code == LP_OK)
        *out = reader.release();
    return code;
}

lp_code read_all(void *samples, lp_oiio_reader *reader, lp_error *err)
{
    bool ok = reader->input->read_image(0, 0, 0, reader->channels, reader->type, samples);
    // A JPEG that ends early is filled up with grey and only a message tells.
    if (!ok || reader->input->has_error())
        return lp_fail(err, LP_INVALID, reader->path.c_str(), "is truncated or damaged: %s",
                       one_line(reader->input->geterror(), reader->path).c_str());
    return LP_OK;
}

} // namespace

extern "C" enum lp_code lp_oiio_encode(uint8_t **out, size_t *out_bytes, const char *format,
                                       const struct lp_oiio_picture *picture, struct lp_error *err)
{
    try {
        return encode(out, out_bytes, format, picture, err);
    } catch (...) {
        return caught(format, err);
    }
}

extern "C" enum lp_code lp_oiio_open(struct lp_oiio_reader **out, struct lp_oiio_header *header,
                                     const char *path, struct lp_error *err)
{
    try {
        return open_reader(out, header, path, err);
    } catch (...) {
        return caught(path, err);
    }
}

extern "C" enum lp_code lp_oiio_read(void *samples, struct lp_oiio_reader *reader,
                                     struct lp_error *err)
{
    try {
        return read_all(samples, reader, err);
    } catch (...) {
        return caught(reader->path.c_str(), err);
    }
}

extern "C" void lp_oiio_close(struct lp_oiio_reader **reader)
{
    if (!reader || !*reader)
        return;
    try {
        if ((*reader)->input)
            (void)(*reader)->input->geterror(); // a message nobody fetched would be printed
        delete *reader;
    } catch (...) { // nothing left to save
    }
    *reader = nullptr;
}
