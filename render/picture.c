// Stand-ins until the drawing lands: every picture says that it cannot be made.
#include "render/picture.h"

#include <stdio.h>

static bool not_yet(char *message, size_t capacity)
{
    if (message && capacity)
        snprintf(message, capacity, "pictures are not built yet");
    return false;
}

PictureOptions picture_default_options(void) { return (PictureOptions){.width = 1600, .height = 1000, .inset = true, .worst_count = 6, .arrows = true}; }
bool picture_available(char *message, size_t capacity) { return not_yet(message, capacity); }

bool picture_of_run(const char *path, const PictureOptions *options, const PictureScene *scene, const PictureTool *tool, char *message,
                    size_t capacity)
{
    (void)path, (void)options, (void)scene, (void)tool;
    return not_yet(message, capacity);
}

bool picture_of_moments(const char *path, const PictureOptions *options, const PictureScene *scene, int tool_count, const PictureTool *tool,
                        char *message, size_t capacity)
{
    (void)path, (void)options, (void)scene, (void)tool_count, (void)tool;
    return not_yet(message, capacity);
}

TriangleMesh *picture_mesh_of_tube(const TubeOptions *tube)
{
    (void)tube;
    return NULL;
}

TriangleMesh *picture_mesh_of_plane(Vec3 point, Vec3 normal, double half_width)
{
    (void)point, (void)normal, (void)half_width;
    return NULL;
}

bool picture_of_projections(const char *path, const PictureOptions *options, int projection_count, const PictureProjection *projection, float low,
                            float high, int polyline_count, const PicturePolyline *polyline, int mark_count, const PictureMark *mark, char *message,
                            size_t capacity)
{
    (void)path, (void)options, (void)projection_count, (void)projection, (void)low, (void)high, (void)polyline_count, (void)polyline;
    (void)mark_count, (void)mark;
    return not_yet(message, capacity);
}

bool picture_of_tree(const char *path, const PictureOptions *options, const int size[3], Vec3 origin, const Vec3 axis[3], const float *value, float low,
                     float high, const VesselTree *tree, int mark_count, const PictureMark *mark, char *message, size_t capacity)
{
    (void)path, (void)options, (void)size, (void)origin, (void)axis, (void)value, (void)low, (void)high, (void)tree, (void)mark_count, (void)mark;
    return not_yet(message, capacity);
}

bool picture_of_fit(const char *path, const PictureOptions *options, const VesselTree *tree, const TriangleMesh *mesh, const double *distance,
                    char *message, size_t capacity)
{
    (void)path, (void)options, (void)tree, (void)mesh, (void)distance;
    return not_yet(message, capacity);
}

bool picture_of_series(const char *path, const PictureOptions *options, int count, const double *time_s, int panel_count, const PicturePanel *panel,
                       int event_count, const PictureEvent *event, char *message, size_t capacity)
{
    (void)path, (void)options, (void)count, (void)time_s, (void)panel_count, (void)panel, (void)event_count, (void)event;
    return not_yet(message, capacity);
}
