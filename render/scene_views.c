#include "render/scene_views.h"

#include "base/base.h"
#include "recon/recon.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// Shapes and tubes have no patient orientation: the axes are chosen so that they are seen face on from the front.
static PatientAxes patient_of(const Scene *scene, const TriangleMesh *mesh)
{
    if (vec3_norm(scene->patient_superior) > 0)
        return (PatientAxes){
            .right = vec3_cross(scene->patient_anterior, scene->patient_superior), .anterior = scene->patient_anterior, .superior = scene->patient_superior};
    if (!mesh || (scene->source != SOURCE_SHAPE && scene->source != SOURCE_TUBE))
        return patient_axes_lps();
    Camera camera = {0};
    camera_orient(&camera, vec3(0, 0, 0), vec3(0, 0, 0), mesh->vertex_count, mesh->vertex);
    return (PatientAxes){.right = vec3_negate(camera.right), .anterior = camera.back, .superior = camera.up};
}

// Cell size for a live-drawn wall: coarse enough to be ready soon, but no coarser than the radius that all but the thinnest twentieth of the nodes exceed; at
// that size a branch
// still has its shape.
static double live_cell(const VesselTree *tree)
{
    enum { TRIANGLES = 150000 };
    double area = 0, *radius = HEAP_ZEROED((size_t)tree->node_count, sizeof *radius);
    for (int i = 0; i < tree->node_count; i++) {
        int parent = tree->parent[i];
        area += parent < 0 ? 0 : 2 * PI * tree->radius[i] * vec3_distance(tree->center[i], tree->center[parent]);
        radius[i] = tree->radius[i];
    }
    sort_doubles(radius, (size_t)tree->node_count);
    double thin = radius[tree->node_count / 20];
    free(radius);
    return fmax(fmin(sqrt(2.3 * area / TRIANGLES), thin), isosurface_cell_for(tree));   // 2.3 triangles per cell face on average
}

// 3 ml/s by hand through a catheter in a carotid artery, up to 20 ml/s by the pump in an aorta: proportional to the cross-section of the vessel.
static double contrast_rate(const VesselTree *tree)
{
    double radius = tree->node_count > 0 ? tree->radius[0] / 2.5 : 1;
    return fmax(1, fmin(20, 3 * radius * radius));
}

static Views *create(Scene *scene, OpenVessel *open, const Volume *volume, const Pose *pose, OperatorControls *controls, char *note, size_t capacity,
                     Faults *faults)
{
    if (!open->mesh && open->tree && !open->sweep)
        open->mesh = cached_isosurface_of_tree(open->tree, live_cell(open->tree));
    const TriangleMesh *mesh = open_vessel_mesh(scene, open);
    ViewsOptions options = {.scene = scene, .vessel = open->vessel, .tree = open->tree, .mesh = mesh, .pose = pose, .patient = patient_of(scene, mesh)};
    if (volume) {
        memcpy(options.anatomy_size, volume->size, sizeof options.anatomy_size);
        memcpy(options.anatomy_axis, volume->axis, sizeof options.anatomy_axis);
        options.anatomy_origin = volume->origin;
        options.anatomy_value = volume->value;
        if (vec3_norm(scene->patient_superior) == 0)
            options.patient = strcmp(volume->frame, "RAS") ? patient_axes_lps() : patient_axes_ras();
    }
    Views *views = views_create(&options, note, capacity);
    if (!views) {
        faults_add(faults, scene->path, 0, 0, "cannot show the scene: %s", note);
        return NULL;
    }
    *controls = mesh ? controls_create(views_scene(views), scene->tool_count, mesh->vertex_count, mesh->vertex)
                     : controls_create(views_scene(views), scene->tool_count, pose->node_count, pose->position);
    controls->patient = options.patient;
    controls->xray.lao_deg = (float)scene->lao;
    controls->xray.cra_deg = (float)scene->cra;
    controls_look_from_arm(controls);
    if (open->tree)
        controls->contrast_ml_s = contrast_rate(open->tree);
    return views;
}

Views *scene_views_create(Scene *scene, OpenVessel *open, OperatorControls *controls, char *note, size_t capacity, Faults *faults)
{
    int before = faults->count;
    Volume *volume = scene->anatomy_path ? volume_load(scene->anatomy_path, faults) : NULL;
    Simulator *simulator = simulator_create(scene, open->vessel, faults);
    Pose *pose = simulator ? pose_create_for(simulator) : NULL;
    XrayControl xray = xray_default_control();
    Views *views = NULL;
    *note = 0;
    if (pose && faults->count == before) {
        pose_take(pose, simulator, &(ToolCommands){0}, &xray);
        views = create(scene, open, volume, pose, controls, note, capacity, faults);
    } else if (faults->count == before) {
        faults_add(faults, scene->path, 0, 0, "cannot show the scene: out of memory");
    }
    pose_free(pose);
    simulator_destroy(simulator);
    volume_free(volume);
    return views;
}
