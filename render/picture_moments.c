#include "render/picture_moments.h"

#include "base/base.h"
#include "render/picture.h"

#include <stdio.h>
#include <stdlib.h>

// `radius` and `force` have room for the nodes of the pose.
static PictureTool tool_of(const Pose *pose, const ToolLooks *looks, double *radius, Vec3 *force)
{
    for (int i = 0; i < pose->node_count; i++) {
        radius[i] = pose->node[i].radius;
        force[i] = pose->node[i].force;
    }
    return (PictureTool){.node_count = pose->node_count,
                         .position = pose->position,
                         .radius = radius,
                         .force = force,
                         .first_free_node = pose->first_free_node,
                         .time_s = pose->time_s,
                         .inserted_mm = pose->inserted_mm,
                         .push_force_n = pose->report.proximal_force,
                         .torque_n_mm = pose->report.proximal_torque,
                         .pose = pose,
                         .looks = looks};
}

static bool draw(const char *path, const char *title, const Scene *scene, OpenVessel *open, int count, const PictureTool *tool, char *message, size_t capacity)
{
    PictureOptions options = picture_default_options();
    PictureScene shown = {.vessel = open_vessel_mesh(scene, open),
                          .target_count = scene->target_count,
                          .target = scene->target,
                          .has_entry = scene->wire.has_sheath,
                          .entry = scene->wire.start};
    options.title = title;
    if (count == 0)
        snprintf(message, capacity, "the run ended before the first moment of --picture-at");
    return count == 1 ? picture_of_run(path, &options, &shown, tool, message, capacity)
                      : count > 1 && picture_of_moments(path, &options, &shown, count, tool, message, capacity);
}

bool picture_moments(const char *path, const char *title, const Scene *scene, OpenVessel *open, const Moments *moments, Faults *faults)
{
    char message[512] = "";
    PictureTool tool[MOMENTS_MOST] = {0};
    ToolLooks looks;
    int count = 0;
    size_t nodes = (size_t)moments->pose[0]->node_capacity;
    bool has_looks = tool_looks_make(&looks, scene);
    double *radius = HEAP_ZEROED(nodes * MOMENTS_MOST, sizeof *radius);
    Vec3 *force = HEAP_ZEROED(nodes * MOMENTS_MOST, sizeof *force);
    for (int i = 0; has_looks && i < moments->count; i++)
        if (moments->is_taken[i])
            tool[count++] = tool_of(moments->pose[i], &looks, radius + (size_t)i * nodes, force + (size_t)i * nodes);
    bool good = draw(path, title, scene, open, count, tool, message, sizeof message);
    if (!good)
        faults_add(faults, path, 0, 0, "no picture: %s", message[0] ? message : "out of memory");
    free(radius);
    free(force);
    tool_looks_free(&looks);
    return good;
}
