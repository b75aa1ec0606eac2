// Checks the outputs of a verb before it begins: that each can be written, and that none is also an input or another output.
// Existing files are compared by device and inode, so links are recognised; files that do not exist yet by folder and name.
#ifndef SELDINGER_CLI_OUTPUT_PLAN_H
#define SELDINGER_CLI_OUTPUT_PLAN_H

#include "base/base.h"
#include "sim/sim.h"

#include <limits.h>

enum { OUTPUT_PLAN_MOST = 8 };

typedef struct PlannedOutput {
    const char *option, *path;       // as given by the user
    const char *ending;              // of the further files of a series; NULL: no series
    char whole[PATH_MAX];            // absolute path without links; "" if nothing can be overwritten: "-", a device, a pipe
} PlannedOutput;

// Add all outputs first, then all inputs. Each fault goes to `faults` and contains both options. A NULL path is ignored.
typedef struct OutputPlan {
    Faults *faults;
    int count;
    PlannedOutput output[OUTPUT_PLAN_MOST];
} OutputPlan;

void output_plan_write(OutputPlan *plan, const char *option, const char *path);
// As output_plan_write() for formats that need a regular file (HDF5, PNG): a device, a pipe or "-" is a fault too.
void output_plan_write_file(OutputPlan *plan, const char *option, const char *path);
// A picture or film. Adds a fault if this build draws none.
void output_plan_picture(OutputPlan *plan, const char *option, const char *path);
// Declares that `option` writes several files: NAME.EXT and also NAME-2.ENDING, … or NAME_00000.ENDING, ….
void output_plan_series(OutputPlan *plan, const char *option, const char *ending);
// `what`: the name of the input for the user: "--script", "the scene".
void output_plan_read(OutputPlan *plan, const char *what, const char *path);
// A volume and the files that contain its samples: those listed in its header, or the whole folder of a DICOM series.
void output_plan_read_volume(OutputPlan *plan, const char *what, const char *path);
// The files of a folder whose names end in `ending` ("": all).
void output_plan_read_folder(OutputPlan *plan, const char *what, const char *folder, const char *ending);
// A scene (NULL: none) and every file that it refers to.
void output_plan_read_scene(OutputPlan *plan, const Scene *scene);

#endif
