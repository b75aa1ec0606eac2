// Recordings for other programs: rows of CSV, or one VTP file per frame with a list of them.
#ifndef SELDINGER_SIM_RECORDING_EXPORT_H
#define SELDINGER_SIM_RECORDING_EXPORT_H

#include "sim/recording.h"

// Writes all frames, one row per node. Returns false with a fault.
bool recording_export_rows(const RecordedRun *run, const char *path, Faults *faults);
// `path` ends in .vtp or .pvd: writes OUT_00000.vtp, OUT_00001.vtp, … and OUT.pvd, which lists them with their times. Returns false with a fault.
bool recording_export_series(const RecordedRun *run, const char *path, Faults *faults);

#endif
