// Recordings for other programs: rows of CSV, or a VTP file a frame with a list of them.
#ifndef SELDINGER_SIM_RECORDING_EXPORT_H
#define SELDINGER_SIM_RECORDING_EXPORT_H

#include "sim/recording.h"

// All frames, a row a node. False with a fault.
bool recording_export_rows(const RecordedRun *run, const char *path, Faults *faults);
// `path` ends in .vtp or .pvd: OUT_00000.vtp and on, and OUT.pvd, which names them with their times. False with a fault.
bool recording_export_series(const RecordedRun *run, const char *path, Faults *faults);

#endif
