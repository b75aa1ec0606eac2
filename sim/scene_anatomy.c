// `anatomy:` of a scene: which vessel of the body it is, and the similarity that takes the body's landmarks to points of the vessel.
#include "sim/patient_landmarks.h"
#include "sim/scene_reading.h"
#include "sim/yaml_vector.h"

#include <stdio.h>

static const double farthest_mm = 1e5;
enum { MOST_LANDMARKS = 32 };
static const NumberRange size_range = {0.6, 1.6, false};     // of the patient, relative to the usual one

static void fault_landmark(YamlValue value, const char *name)
{
    char all[400];
    size_t used = 0;
    for (int i = 0; patient_landmark_name[i] && used < sizeof all; i++)
        used += (size_t)snprintf(all + used, sizeof all - used, "%s%s", i ? ", " : "", patient_landmark_name[i]);
    yaml_fault(value, "no landmark '%.40s' on this segment; expected left_ or right_ and one of: %s", name, all);
}

static bool read_landmark(YamlValue value, int segment, Vec3 *body, Vec3 *model)
{
    static const char *const keys[] = {"name", "point_mm", NULL};
    YamlMap map = yaml_map(value, keys);
    const char *name;
    bool has_point = yaml_map_vector(&map, "point_mm", true, farthest_mm, model);
    if (!yaml_text(yaml_get(&map, "name", true), &name) || segment < 0)
        return false;
    if (patient_landmark_at(name, segment, body))
        return has_point;
    fault_landmark(yaml_get(&map, "name", false), name);
    return false;
}

// With the patient's axes, or three landmarks that are not on a line; otherwise the axes are known only with the volume, and the fit must wait.
static void fit(Scene *scene, YamlValue value, int count, const Vec3 *body, const Vec3 *model)
{
    bool has_axes = vec3_norm(scene->patient_superior) > 0;
    Mat3 axes = mat3_from_columns(vec3_cross(scene->patient_anterior, scene->patient_superior), scene->patient_anterior, scene->patient_superior);
    Similarity found;
    if (!similarity_fit(count, body, model, has_axes ? &axes : NULL, &found)) {
        yaml_fault(value, has_axes ? "the landmarks lie the other way round than 'anterior' and 'superior' say; expected points in the patient's order"
                                   : "the landmarks leave the patient's direction open; expected three that are not on a line, or 'fluoroscopy: anterior' "
                                     "and 'superior'");
        return;
    }
    if (found.scale < size_range.least || found.scale > size_range.most) {
        yaml_fault(value, "by the landmarks the patient has %.2f times the usual size; expected %g to %g", found.scale, size_range.least, size_range.most);
        return;
    }
    scene->has_anatomy_fit = true;
    scene->anatomy_fit = found;
    scene->patient_anterior = mat3_column(&found.turn, 1);
    scene->patient_superior = mat3_column(&found.turn, 2);
}

void scene_read_anatomy(Reading *reading, YamlValue value)
{
    static const char *const keys[] = {"segment", "landmarks", NULL};
    Scene *scene = reading->scene;
    Vec3 body[MOST_LANDMARKS] = {0}, model[MOST_LANDMARKS] = {0};
    if (!yaml_is_map(value)) {
        scene->anatomy_segment = 1 + yaml_choice(value, patient_segment_name);
        return;
    }
    YamlMap map = yaml_map(value, keys);
    scene->anatomy_segment = 1 + yaml_choice(yaml_get(&map, "segment", true), patient_segment_name);
    YamlValue list = yaml_get(&map, "landmarks", false);
    int count = yaml_has(&map, "landmarks") ? yaml_count(list, 1, MOST_LANDMARKS) : 0, sound = 0;
    for (int i = 0; i < count; i++)
        sound += read_landmark(yaml_item(list, i), scene->anatomy_segment - 1, &body[sound], &model[sound]);
    if (count > 0 && sound == count)
        fit(scene, list, count, body, model);
}
