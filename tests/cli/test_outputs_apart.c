// No verb overwrites an input, and no output overwrites another: refused before anything is written, with the names of both options.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

static char folder[] = "/tmp/seldinger-apart-XXXXXX";
#include "tests/folder.h"
#include "tests/cli/program.h"

static const char scene[] = "seldinger: 1\nvessel: {model: model.h5}\nsheath: {inlet: root}\n"
                            "wire: {elements: 10, sections: [{length_mm: 30, diameter_mm: 0.36, young_modulus_gpa: 80}]}\nscript: hand.csv\n";
static const char tube[] = "seldinger: 1\nvessel: {tube: {start_mm: [0, 0, 0], direction: [1, 0, 0], normal: [0, 1, 0], radius_mm: 2, path: [{line_mm: 60}]}}\n"
                           "sheath: {entry_mm: [0, 0, 0], direction: [1, 0, 0], inserted_mm: 5}\n"
                           "wire: {elements: 10, sections: [{length_mm: 30, diameter_mm: 0.36, young_modulus_gpa: 80}]}\nscript: hand.csv\n";

static void must_run(const char *arguments)
{
    if (run_in("", arguments) != 0)
        fail_msg("`%s` failed: %s", arguments, output);
}

static int make_files(void **state)
{
    if (make_folder_with_cache(state) != 0)
        return -1;
    must_run("synth arc --points 200 -o tree.h5 --quiet");
    must_run("fit tree.h5 -o model.h5 --preset local --quiet");
    must_run("synth arc --voxel-mm 0.5 -o volume.nrrd --quiet");
    put("scene.yaml", scene);
    put("tube.yaml", tube);
    put("hand.csv", "t_s,push_mm_s,twist_deg_s\n0,5,0\n0.02,0,0\n");
    put("points.csv", "x_mm,y_mm,z_mm\n0,0,0\n");
    put("trace.yaml", "branches: [{start_mm: [1, 1, 1], toward_mm: [2, 2, 2], radius_mm: 1}]\n");
    put("split.nhdr", "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 2 2 2\nencoding: raw\ndata file: split.raw\n");
    put("split.mhd", "ObjectType = Image\nNDims = 3\nDimSize = 2 2 2\nElementType = MET_UCHAR\nElementDataFile = split.raw\n");
    put("slices.mhd", "ObjectType = Image\nNDims = 3\nDimSize = 2 2 2\nElementType = MET_UCHAR\nElementDataFile = slice%02d.raw 1 2 1\n");
    put("split.raw", "abcdefgh");
    put("slice01.raw", "abcd");
    put("slice02.raw", "abcd");
    char path[200];
    return symlink("tree.h5", in_folder("link.h5")) || link(strcpy(path, in_folder("tree.h5")), in_folder("hard.h5")) ||
           symlink("later.h5", in_folder("dangling.h5")) || mkdir(in_folder("sub"), 0755);
}

// Exit code 2, the message, and all files unchanged.
static void refused(const char *arguments, const char *words)
{
    static char before[1 << 16], after[1 << 16];
    char *const sum[] = {before, after};
    int code = 0;
    for (int i = 0; i < 2; i++) {
        char command[300];
        if (i == 1)
            code = run_in("", arguments);
        snprintf(command, sizeof command, "cd '%s' && find . -type f -o -type l | sort | xargs sha256sum 2>&1; ls", folder);
        FILE *pipe = popen(command, "r");
        assert_non_null(pipe);
        sum[i][fread(sum[i], 1, sizeof before - 1, pipe)] = 0;
        pclose(pipe);
    }
    if (code != 2 || !strstr(output, words))
        fail_msg("`%s` ended with %d and printed: %s(expected 2 and '%s')", arguments, code, output, words);
    if (strcmp(before, after) != 0)
        fail_msg("`%s` changed files", arguments);
}

static void runs_keep_their_scene(void **state)
{
    (void)state;
    refused("run tube.yaml --summary tube.yaml", "tube.yaml: --summary would overwrite the scene tube.yaml; choose another name");
    refused("run scene.yaml --summary scene.yaml", "--summary would overwrite the scene scene.yaml");
    refused("run tube.yaml --final hand.csv", "--final would overwrite the scene's script ");
    refused("run tube.yaml --script points.csv --final points.csv", "--final would overwrite --script points.csv");
    refused("run scene.yaml --record model.h5", "--record would overwrite the scene's model ");
    refused("run scene.yaml --record ./sub/../model.h5", "--record would overwrite the scene's model ");
    refused("run tube.yaml --score a.json --summary a.json", "a.json: --summary and --score would write the same file");
    refused("run tube.yaml --final sub/b.csv --summary sub/../sub/b.csv", "--summary and --final would write the same file");
    char path[200];
    assert_int_equal(link(strcpy(path, in_folder("tube.yaml")), in_folder("tube.golden.csv")), 0);
    refused("check tube.yaml --update", "--update would overwrite the scene");
    unlink(in_folder("tube.golden.csv"));
}

static void trees_and_models_are_kept(void **state)
{
    (void)state;
    refused("fit tree.h5 -o z.h5 --json z.h5", "z.h5: -o and --json would write the same file");
    refused("fit tree.h5 -o tree.h5", "tree.h5: -o would overwrite the tree tree.h5");
    refused("fit tree.h5 -o link.h5", "link.h5: -o would overwrite the tree tree.h5");
    refused("fit tree.h5 -o hard.h5", "hard.h5: -o would overwrite the tree tree.h5");
    refused("fit link.h5 -o tree.h5", "tree.h5: -o would overwrite the tree link.h5");
    refused("fit tree.h5 -o dangling.h5 --json later.h5", "would write the same file");
    refused("fit tree.h5 -o out.h5 --junctions out.h5", "-o and --junctions would write the same file");
    refused("fit tree.h5 -o out.h5 --junctions j.png --volume split.mhd --json split.raw", "--json would overwrite --volume split.raw");
    refused("query model.h5 --points points.csv -o points.csv", "-o would overwrite --points points.csv");
    refused("query model.h5 --points points.csv -o model.h5", "-o would overwrite the model");
    refused("synth arc --measure model.h5 --json model.h5", "--json would overwrite --measure model.h5");
    refused("export model.h5 -o model.h5", "-o would overwrite the file model.h5");
    refused("info model.h5 --report model.h5", "--report would overwrite the file model.h5");
    refused("info model.h5 --picture p.png --junctions p.png", "--picture and --junctions would write the same file");
    char path[200];
    assert_int_equal(link(strcpy(path, in_folder("model.h5")), in_folder("sheet-2.png")), 0);
    refused("info sheet-2.png --junctions sheet.png", "--junctions would overwrite the file sheet-2.png");
    assert_int_equal(rename(strcpy(path, in_folder("sheet-2.png")), in_folder("sheet_00007.vtp")), 0);
    refused("export sheet_00007.vtp -o sheet.pvd", "-o would overwrite the file sheet_00007.vtp");
    unlink(in_folder("sheet_00007.vtp"));
    refused("info model.h5 --junctions tree.h5 --before tree.h5", "--junctions would overwrite --before tree.h5");
}

static void volumes_and_their_samples_are_kept(void **state)
{
    (void)state;
    refused("segment volume.nrrd --trace trace.yaml -o volume.nrrd", "-o would overwrite the volume volume.nrrd");
    refused("segment volume.nrrd --trace trace.yaml -o o.h5 --json trace.yaml", "--json would overwrite --trace trace.yaml");
    refused("segment volume.nrrd --trace trace.yaml -o o.h5 --json o.h5", "would write the same file");
    refused("segment split.nhdr --trace trace.yaml -o split.raw", "-o would overwrite the volume split.raw");
    refused("segment split.mhd --trace trace.yaml -o split.raw", "-o would overwrite the volume split.raw");
    refused("segment slices.mhd --trace trace.yaml -o slice02.raw", "-o would overwrite the volume slice02.raw");
    refused("segment . --trace trace.yaml -o points.csv", "-o would overwrite the volume ./points.csv");
    refused("import --surface split.raw -o split.raw", "-o would overwrite --surface split.raw");
    refused("import --surface split.raw --centreline points.csv -o o.h5 --json points.csv", "--json would overwrite --centreline points.csv");
    refused("import --surface split.raw -o o.h5 --json c.vtp --centerline-out c.vtp", "--json and --centerline-out would write the same file");
}

static void sessions_and_tables_are_kept(void **state)
{
    (void)state;
    put("session.json", "{}");
    put("other.json", "{}");
    refused("report session.json --html session.json", "--html would overwrite the session session.json");
    refused("report session.json --html other.json", "--html would overwrite the session ./other.json");
    must_run("run tube.yaml --duration-s 0.01 --record recording.h5 --quiet");
    refused("report recording.h5 --html recording.h5", "--html would overwrite the recording recording.h5");
    refused("report recording.h5 --html recording.json", "--html would overwrite the session recording.json");      // which is made first
    refused("report session.json --html h.pdf --pdf h.pdf", "--html and --pdf would write the same file");
    refused("bench collision --json c.svg --chart c.svg", "--json and --chart would write the same file");
    refused("bench fit --tables45 --tree tree.h5 --json tree.h5", "--json would overwrite --tree tree.h5");
    refused("devices --map trace.yaml --json trace.yaml", "--json would overwrite --map trace.yaml");
}

static void a_recording_and_its_scene_are_kept(void **state)
{
    (void)state;
    mkdir(in_folder("rec"), 0755);
    put("rec/scene.yaml", tube);
    put("rec/hand.csv", "t_s,push_mm_s,twist_deg_s\n0,5,0\n0.02,0,0\n");
    must_run("run rec/scene.yaml --record rec/run.h5 --quiet");
    refused("replay rec/run.h5 --picture rec/run.h5", "--picture would overwrite the recording rec/run.h5");
    refused("replay rec/run.h5 --scene rec", "--scene would overwrite the scene");
    must_run("replay rec/run.h5 --scene again --quiet");
    must_run("replay rec/run.h5 --scene again --quiet");
}

// /dev/null may be given twice; files beside the inputs are allowed.
static void what_loses_nothing_is_allowed(void **state)
{
    (void)state;
    must_run("run tube.yaml --summary /dev/null --final /dev/null --quiet");
    must_run("run tube.yaml --summary sub/summary.json --final sub/final.csv --quiet");
    must_run("run tube.yaml --summary sub/summary.json --final sub/final.csv --quiet");
    must_run("fit tree.h5 -o sub/model.h5 --preset local --quiet");
    must_run("query model.h5 --points points.csv -o -");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_loses_nothing_is_allowed), cmocka_unit_test(runs_keep_their_scene),
        cmocka_unit_test(trees_and_models_are_kept),     cmocka_unit_test(volumes_and_their_samples_are_kept),
        cmocka_unit_test(sessions_and_tables_are_kept),  cmocka_unit_test(a_recording_and_its_scene_are_kept),
    };
    return cmocka_run_group_tests(tests, make_files, remove_folder);
}
