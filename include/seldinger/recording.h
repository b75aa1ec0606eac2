// Recordings written by `seldinger run --record`, `seldinger nav` and sel_simulator_record(): reading and replay.
#ifndef SELDINGER_PUBLIC_RECORDING_H
#define SELDINGER_PUBLIC_RECORDING_H

#include "simulator.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct SelRecording SelRecording;

// Reads a whole recording into memory. Errors: SEL_ERROR_ARGUMENT, SEL_ERROR_INPUT, SEL_ERROR_MEMORY.
SEL_API SelStatus sel_recording_open(SelContext *context, const char *path, SelRecording **recording);
SEL_API void sel_recording_destroy(SelRecording *recording);

SEL_API int64_t sel_recording_steps(const SelRecording *recording);
SEL_API double sel_recording_step_s(const SelRecording *recording);              // [s] duration of a step
SEL_API int sel_recording_tool_count(const SelRecording *recording);
// For step 0 to steps - 1: the command of the hands, the state's hash after the step, force [N] and torque [N mm] at a tool's hand (either may be NULL).
// Error: SEL_ERROR_ARGUMENT (no such step or tool).
SEL_API SelStatus sel_recording_hand(const SelRecording *recording, int64_t step, SelHand *hand);
SEL_API SelStatus sel_recording_hash(const SelRecording *recording, int64_t step, uint64_t *hash);
SEL_API SelStatus sel_recording_force(const SelRecording *recording, int64_t step, int tool, double *push_n, double *torque_n_mm);

// All steps at once; any array may be NULL: (steps, tools, 2) push [mm/s] and twist [deg/s], (steps) hashes, (steps, tools) force [N] and torque [N mm] at the
// hands. Error: SEL_ERROR_ARGUMENT.
SEL_API SelStatus sel_recording_arrays(const SelRecording *recording, double *command, uint64_t *hash, double *push_n, double *torque_n_mm);

// Frames: the centreline that all tools share, every 10 ms in a run's recording. `step`: the step that a frame shows; may be NULL. Writes up to `capacity`
// points, xyz one after the other, and the number available, which may be larger. Error: SEL_ERROR_ARGUMENT.
SEL_API int64_t sel_recording_frames(const SelRecording *recording);
SEL_API SelStatus sel_recording_frame(const SelRecording *recording, int64_t frame, int64_t *step, double *position_mm, int capacity, int *count);

// Opens the recorded scene again; files that it refers to are read from their original paths. `options` may be NULL; a script in it is an argument error.
// Errors as for sel_scene_open().
SEL_API SelStatus sel_recording_scene(SelContext *context, const SelRecording *recording, const SelOpenOptions *options, SelScene **scene);

typedef struct SelVerdict {
    int64_t steps;               // number of steps simulated
    int64_t first_different;     // the first step whose state differs; -1: none
    uint64_t recorded, simulated;    // the hashes at that step; if none differs, those of the last step
} SelVerdict;
// Simulates a recording again in `scene` (of sel_recording_scene()) and compares the state of each step; stops at the first that differs. `verdict` may be
// NULL. Errors: SEL_DIFFERENT, SEL_ERROR_ARGUMENT, SEL_ERROR_INPUT (the scene's tools differ from the recording's), SEL_ERROR_MEMORY.
SEL_API SelStatus sel_recording_verify(SelContext *context, const SelRecording *recording, const SelScene *scene, SelVerdict *verdict);

#ifdef __cplusplus
}
#endif

#endif
