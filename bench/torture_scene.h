// Random scenes for `bench torture`: a vessel, tools and commands from a seed, as the text of a scene file, so that a failed run can be kept and
// repeated by `seldinger run`.
#ifndef SELDINGER_BENCH_TORTURE_SCENE_H
#define SELDINGER_BENCH_TORTURE_SCENE_H

#include <stdbool.h>
#include <stdint.h>

typedef enum { TORTURE_TUBE, TORTURE_SHAPE, TORTURE_MODEL, TORTURE_VESSELS } TortureVessel;      // exact tubes, synthetic shapes (fitted), models from files
typedef enum { TORTURE_STRAIGHT, TORTURE_J, TORTURE_SIMMONS, TORTURE_PIGTAIL, TORTURE_COAXIAL, TORTURE_TOOLS } TortureTool;
extern const char *const torture_vessel_name[TORTURE_VESSELS], *const torture_tool_name[TORTURE_TOOLS];

typedef struct TortureScene {
    TortureVessel vessel;
    TortureTool tool;
    double step_ms;
    char *text;              // the caller frees
} TortureScene;

// The scene of a seed: the same text for the same arguments. `model`: files for TORTURE_MODEL (none: that kind is not used), `lumen_mm` the radius
// at the inlet of each. `text` is NULL if out of memory.
TortureScene torture_scene(uint64_t seed, int64_t steps, int model_count, const char *const *model, const double *lumen_mm);
// The same scene, but with steps and elements half as long: if this run ends elsewhere, the first one was not converged.
char *torture_scene_finer(uint64_t seed, int64_t steps, int model_count, const char *const *model, const double *lumen_mm);

#endif
