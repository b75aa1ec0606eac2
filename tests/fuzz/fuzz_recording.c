// Any bytes as a recording: faults, or a run all of whose figures can be accessed. The reader first reads each file in a child process, which makes this slow.
// Covers: sim/recorded_run.c recon/hdf5_reader.c recon/hdf5_source.c
#include "sim/recording.h"
#include "tests/fuzz/given_files.h"

#include <math.h>

const char *__lsan_default_suppressions(void);
// libhdf5 1.10 loses some bytes of its own with files that it refuses to open
const char *__lsan_default_suppressions(void) { return "leak:libhdf5"; }

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void look_at(const RecordedRun *run)
{
    double sum = 0;
    for (int64_t i = 0; i < run->step_count; i++) {
        ToolCommands commands = recorded_run_commands(run, i);
        sum += run->time_s[i] + commands.tool[0].push_mm_s + commands.contrast_ml_s + run->wall_force[2 * i + 1];
    }
    for (int64_t i = 0; i < run->frame_count; i++) {
        RecordedFrame at = recorded_run_frame(run, i);
        for (int n = 0; n < at.node_count; n++)
            sum += at.s[n] + at.radius[n] + at.position[n].z + at.quaternion[n].z;
        for (int k = 0; run->frame_nodes && k < run->tool_count; k++) {
            RecordedToolFrame own = recorded_run_tool_frame(run, k, i);
            for (int n = 0; n < own.node_count; n++)
                sum += own.s[n] + own.radius[n] + own.position[n].z + own.quaternion[n].z + own.carrier[n];
        }
    }
    if (isnan(sum) || run->tool_count < 1 || run->tool_count > STEP_TOOLS_MAX)
        abort();
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static const char *const names[] = {"run.h5", NULL};
    static Faults faults;
    faults_clear(&faults);
    given_files(data, size, names);
    RecordedRun *run = recorded_run_load(given_path(names[0]), &faults);
    if (!run != (faults.count > 0))
        abort();
    if (run)
        look_at(run);
    recorded_run_free(run);
    return 0;
}
