/* GET /v1/scenes and GET /v1/scenes/{name}. */
#include "server/api.h"

void api_scenes(struct http_request *request)
{
    struct wire_problem problem = {0};
    char *text;
    if (scenes_write(request->server->scenes, &text, &problem, NULL))
        http_problem(request, &problem);
    else
        http_text(request, 200, "application/json", text);
}

void api_scene(struct http_request *request)
{
    struct wire_problem problem = {0};
    char name[WIRE_NAME_BYTES];
    char *text;
    if (!http_param(request, 0, name, sizeof name))
        name[0] = 0; /* too long to be one; the sentence about names answers */
    if (scenes_write(request->server->scenes, &text, &problem, name))
        http_problem(request, &problem);
    else
        http_text(request, 200, "application/json", text);
}
