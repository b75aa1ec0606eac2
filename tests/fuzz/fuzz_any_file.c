// A file of unknown kind, as `info` opens it: the kind is recognised by the content, then the reader of that kind is called.
// Covers: cli/file_kind.c base/text_file.c base/whole_file.c
#include "cli/file_kind.h"
#include "recon/surface/surface_file.h"
#include "recon/tree_file.h"
#include "recon/volume/volume_file.h"
#include "sim/scene.h"
#include "tests/fuzz/given_files.h"

const char *__lsan_default_suppressions(void);
const char *__lsan_default_suppressions(void) { return "leak:libhdf5"; }

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static const char *const names[] = {"file", NULL};
    static Faults faults;
    static ScriptTools tools;
    faults_clear(&faults);
    given_files(data, size, names);
    const char *path = given_path(names[0]);
    switch (file_kind(path)) {
    case FILE_TREE: vessel_tree_free(tree_file_load(path, NULL, &faults)); break;
    case FILE_SCENE: scene_free(scene_load(path, &faults)); break;
    case FILE_SCRIPT: script_free(script_load_any(path, &tools, &faults)); break;
    case FILE_VOLUME: volume_free(volume_load(path, &faults)); break;
    case FILE_SURFACE: surface_free(surface_load(path, &faults)); break;
    case FILE_MISSING: abort();
    default: break;
    }
    return 0;
}
