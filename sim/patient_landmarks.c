// Positions from textbooks of anatomy and from the bones beside which the vessels run: the carotid canal enters 20 mm below the petrous ridge, the siphon turns
// beside the sella, the arch lies at the fourth thoracic vertebra, the aorta forks before the fourth lumbar one.
#include "sim/patient_landmarks.h"

#include <string.h>

// name, position, side; once more with a side in front: on the right
#define SIDED_SEGMENT(X, name, x, y, z) X("right_" name, x, y, z, 1) X("left_" name, -(x), y, z, -1)
#define SEGMENTS(X)                                                                                                                                            \
    SIDED_SEGMENT(X, "internal_carotid", 20, 2, 2)                                                                                                             \
    SIDED_SEGMENT(X, "common_carotid", 26, -14, -150)                                                                                                          \
    SIDED_SEGMENT(X, "middle_cerebral", 34, 2, 16)                                                                                                             \
    SIDED_SEGMENT(X, "anterior_cerebral", 4, 26, 30)                                                                                                           \
    SIDED_SEGMENT(X, "posterior_cerebral", 16, -24, 6)                                                                                                         \
    SIDED_SEGMENT(X, "vertebral", 22, -32, -100)                                                                                                               \
    SIDED_SEGMENT(X, "subclavian", 60, -30, -195)                                                                                                              \
    X("basilar", 0, -14, -14, 0)                                                                                                                               \
    X("aortic_arch", -6, -34, -270, 0)                                                                                                                         \
    X("thoracic_aorta", -14, -42, -330, 0)                                                                                                                     \
    X("abdominal_aorta", -4, -36, -490, 0)                                                                                                                     \
    X("aorta", -4, -40, -330, 0)

// name, position, whether there is one on each side: then on the right
#define LANDMARKS(X)                                                                                                                                           \
    X("carotid_fork", 27, -12, -112, true)                                                                                                                     \
    X("skull_base", 27, -19, -38, true)                                                                                                                        \
    X("petrous_bend", 25, -19, -22, true)                                                                                                                      \
    X("siphon", 10, 7, -1, true)                                                                                                                               \
    X("carotid_end", 12, 1, 12, true)                                                                                                                          \
    X("middle_cerebral_fork", 38, 5, 12, true)                                                                                                                 \
    X("insula", 46, -8, 24, true)                                                                                                                              \
    X("callosal_bend", 2, 40, 38, true)                                                                                                                        \
    X("vertebral_at_atlas", 24, -38, -56, true)                                                                                                                \
    X("vertebral_origin", 30, -24, -186, true)                                                                                                                 \
    X("subclavian_at_rib", 72, -18, -178, true)                                                                                                                \
    X("femoral_head", 92, 10, -690, true)                                                                                                                      \
    X("anterior_communicating", 0, 14, 14, false)                                                                                                              \
    X("basilar_start", 0, -16, -34, false)                                                                                                                     \
    X("basilar_end", 0, -12, 6, false)                                                                                                                         \
    X("aortic_valve", 2, -4, -322, false)                                                                                                                      \
    X("arch_top", -8, -32, -236, false)                                                                                                                        \
    X("brachiocephalic_origin", 4, -22, -242, false)                                                                                                           \
    X("left_common_carotid_origin", -8, -30, -238, false)                                                                                                      \
    X("left_subclavian_origin", -18, -42, -240, false)                                                                                                         \
    X("aorta_at_diaphragm", -12, -44, -405, false)                                                                                                             \
    X("aortic_fork", -4, -30, -535, false)

#define SEGMENT_ROW(name, x, y, z, side) {name, {x, y, z}, side},
#define NAME_ROW(name, x, y, z, last) name,
#define PLACE_ROW(name, x, y, z, is_paired) {{x, y, z}, is_paired},

const PatientSegment patient_segment[] = {SEGMENTS(SEGMENT_ROW){NULL, {0, 0, 0}, 0}};
const char *const patient_segment_name[] = {SEGMENTS(NAME_ROW) NULL};
const char *const patient_landmark_name[] = {LANDMARKS(NAME_ROW) NULL};

static const struct {
    Vec3 at;
    bool is_paired;
} place[] = {LANDMARKS(PLACE_ROW)};

static int index_of(const char *name)
{
    for (int i = 0; patient_landmark_name[i]; i++)
        if (!strcmp(patient_landmark_name[i], name))
            return i;
    return -1;
}

bool patient_landmark_at(const char *name, int segment, Vec3 *at)
{
    static const char *const front[2] = {"left_", "right_"};
    int found = index_of(name), side = patient_segment[segment].side;
    for (int k = 0; found < 0 && k < 2; k++)
        if (!strncmp(name, front[k], strlen(front[k]))) {
            found = index_of(name + strlen(front[k]));
            found = found >= 0 && place[found].is_paired ? found : -1;
            side = 2 * k - 1;
        }
    if (found < 0 || (place[found].is_paired && side == 0))
        return false;
    *at = place[found].at;
    if (place[found].is_paired)
        at->x *= side;
    return true;
}
