// What a verb is going to write, checked before it begins: that each output can be written, and that none is an input or another output.
// Files are the same by what they are (device and inode, so links are seen through), those that are not there yet by folder and name.
#ifndef SELDINGER_CLI_OUTPUT_PLAN_H
#define SELDINGER_CLI_OUTPUT_PLAN_H

#include "base/base.h"
#include "sim/sim.h"

#include <limits.h>

enum { OUTPUT_PLAN_MOST = 8 };

typedef struct PlannedOutput {
    const char *option, *path;       // as the user gave them
    const char *ending;              // of its further files; NULL: it has none
    char whole[PATH_MAX];            // absolute and without links; "" where nothing can be lost: "-", a device, a pipe
} PlannedOutput;

// First all outputs, then all inputs; each fault goes to `faults` and names both options. A path that is NULL is no file.
typedef struct OutputPlan {
    Faults *faults;
    int count;
    PlannedOutput output[OUTPUT_PLAN_MOST];
} OutputPlan;

void output_plan_write(OutputPlan *plan, const char *option, const char *path);
// The same for what only whole files can hold (HDF5, PNG): a device, a pipe or "-" is a fault too.
void output_plan_write_file(OutputPlan *plan, const char *option, const char *path);
// A picture or film: a fault where this build draws none.
void output_plan_picture(OutputPlan *plan, const char *option, const char *path);
// What `option` writes becomes several files: beside NAME.EXT also NAME-2.ENDING or NAME_00000.ENDING and on.
void output_plan_series(OutputPlan *plan, const char *option, const char *ending);
// `what` the user knows it as: "--script", "the scene".
void output_plan_read(OutputPlan *plan, const char *what, const char *path);
// A volume and the files that hold its samples: those that its header names, and all of a DICOM series' folder.
void output_plan_read_volume(OutputPlan *plan, const char *what, const char *path);
// The files of a folder whose names end in `ending` ("": all).
void output_plan_read_folder(OutputPlan *plan, const char *what, const char *folder, const char *ending);
// A scene (NULL: none) and every file that it names.
void output_plan_read_scene(OutputPlan *plan, const Scene *scene);

#endif
