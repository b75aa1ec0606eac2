// One run of a sweep. Runs are independent: any number of them at the same time, each on its thread.
#ifndef SELDINGER_STUDY_ONE_RUN_H
#define SELDINGER_STUDY_ONE_RUN_H

#include "study/open_study.h"

#include <signal.h>

// Simulates run `run`. Returns its result, one line of JSON without a line break:
//   {"run":7,"status":"done","message":"","state_hash":"7101e2090e328aed","cpu_s":0.53,"figures":{"steps":6500,…}}
// All but cpu_s, the processor time that it took, is the same on every machine. The caller frees it. A scene that cannot be opened is a result too ("failed"). NULL if
// *stop became 1, or with faults if the recording could not be written. `recordings`: the folder for RUN.h5, used as the specification says; NULL: none.
char *one_run(OpenStudy *open, int64_t run, const char *recordings, const volatile sig_atomic_t *stop, Faults *faults);

// Repeats run `run` and writes scene.yaml, script.csv, recording.h5 and summary.json into `folder`, which must exist. The scene names its files by absolute
// paths. Returns its result as one_run() does, or NULL with faults.
char *one_run_repeat(OpenStudy *open, int64_t run, const char *folder, Faults *faults);

#endif
