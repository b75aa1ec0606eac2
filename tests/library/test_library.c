// The library as used by a host program: only public headers and libseldinger.so.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <hdf5.h>
#include <locale.h>
#include <math.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <seldinger/seldinger.h>

#include "tests/short_run.h"

static char folder[] = "/tmp/seldinger-library-XXXXXX";
#include "tests/folder.h"

static const char phantom[] = SOURCE_DIR "/scenes/phantom/scene.yaml";
static SelContext *context;
static SelScene *scene;      // the phantom

static int open_phantom(void **state)
{
    (void)state;
    if (make_folder(state) != 0 || sel_context_create(NULL, &context) != SEL_OK)
        return -1;
    return sel_scene_open(context, phantom, NULL, &scene) == SEL_OK ? 0 : -1;
}

static int close_phantom(void **state)
{
    sel_scene_destroy(scene);
    sel_context_destroy(context);
    return remove_folder(state);
}

static void good(SelStatus status)
{
    if (status != SEL_OK)
        fail_msg("%s: %s", sel_status_name(status), sel_fault(context, 0));
}

static SelSimulator *new_simulator(const SelScene *of)
{
    SelSimulator *simulator = NULL;
    good(sel_simulator_create(context, of, NULL, &simulator));
    return simulator;
}

static void step_by_script(SelSimulator *simulator, int steps)
{
    for (int i = 0; i < steps; i++) {
        SelHand hand;
        good(sel_simulator_script_hand(simulator, &hand));
        good(sel_simulator_step(simulator, &hand));
    }
}

static uint64_t hash_after(const SelScene *of, int steps)
{
    SelSimulator *simulator = new_simulator(of);
    step_by_script(simulator, steps);
    uint64_t hash = sel_simulator_hash(simulator);
    sel_simulator_destroy(simulator);
    return hash;
}

// --- errors ---

static void expect_fault(const char *words)
{
    assert_true(sel_fault_count(context) > 0);
    if (!strstr(sel_fault(context, 0), words))
        fail_msg("expected '%s', got '%s'", words, sel_fault(context, 0));
}

static void wrong_arguments_are_refused(void **state)
{
    (void)state;
    SelScene *none = NULL;
    SelSimulator *simulator = NULL;
    SelOpenOptions unset = {0};
    SelReport report;
    assert_int_equal(sel_context_create(NULL, NULL), SEL_ERROR_ARGUMENT);
    assert_int_equal(sel_scene_open(NULL, phantom, NULL, &none), SEL_ERROR_ARGUMENT);
    assert_int_equal(sel_scene_open(context, NULL, NULL, &none), SEL_ERROR_ARGUMENT);
    expect_fault("sel_scene_open: context, path or scene is NULL");
    assert_int_equal(sel_scene_open(context, phantom, &unset, &none), SEL_ERROR_ARGUMENT);
    expect_fault("sel_open_defaults()");
    double point[3] = {0}, gap = 0;
    assert_int_equal(sel_scene_query(NULL, scene, 1, point, &gap, NULL), SEL_ERROR_ARGUMENT);
    assert_int_equal(sel_scene_query(context, NULL, 1, point, &gap, NULL), SEL_ERROR_ARGUMENT);
    assert_int_equal(sel_scene_query(context, scene, -1, point, &gap, NULL), SEL_ERROR_ARGUMENT);
    assert_int_equal(sel_scene_query(context, scene, 1, NULL, &gap, NULL), SEL_ERROR_ARGUMENT);
    assert_int_equal(sel_scene_query(context, scene, 1, point, NULL, NULL), SEL_ERROR_ARGUMENT);
    assert_int_equal(sel_simulator_create(context, NULL, NULL, &simulator), SEL_ERROR_ARGUMENT);
    assert_int_equal(sel_simulator_step(NULL, NULL), SEL_ERROR_ARGUMENT);
    assert_int_equal(sel_simulator_report(NULL, &report, sizeof report), SEL_ERROR_ARGUMENT);
    assert_int_equal(sel_recording_verify(context, NULL, scene, NULL), SEL_ERROR_ARGUMENT);
    assert_int_equal(sel_tree_open(context, NULL, NULL), SEL_ERROR_ARGUMENT);
    assert_int_equal(sel_fit(context, NULL, NULL, NULL), SEL_ERROR_ARGUMENT);
    assert_null(none);
    assert_null(simulator);
    assert_true(sel_simulator_hash(NULL) == 0 && sel_recording_steps(NULL) == 0 && sel_tree_node_count(NULL) == 0 && sel_scene_text(NULL) == NULL);
    sel_scene_destroy(NULL);
    sel_simulator_destroy(NULL);
    sel_recording_destroy(NULL);
    sel_volume_destroy(NULL);
    sel_tree_destroy(NULL);
    sel_context_destroy(NULL);
}

static void missing_files_are_named(void **state)
{
    (void)state;
    SelScene *none = NULL;
    SelRecording *recording = NULL;
    SelVolume *volume = NULL;
    SelTree *tree = NULL;
    assert_int_equal(sel_scene_open(context, "/nowhere/a.yaml", NULL, &none), SEL_ERROR_INPUT);
    expect_fault("/nowhere/a.yaml");
    assert_int_equal(sel_recording_open(context, "/nowhere/a.h5", &recording), SEL_ERROR_INPUT);
    expect_fault("/nowhere/a.h5");
    assert_int_equal(sel_volume_open(context, "/nowhere/a.nrrd", &volume), SEL_ERROR_INPUT);
    expect_fault("/nowhere/a.nrrd");
    assert_int_equal(sel_tree_open(context, phantom, &tree), SEL_ERROR_INPUT);
    expect_fault("scene.yaml");
    assert_true(!none && !recording && !volume && !tree);
}

// All faults in one call, each with line and column.
static void faults_have_their_place(void **state)
{
    (void)state;
    static const char text[] = "seldinger: 1\nwire:\n  sections: [{length_mm: -3, diameter_mm: 0.36, young_modulus_gpa: 80}]\nsheat: {inlet: root}\n";
    SelScene *none = NULL;
    assert_int_equal(sel_scene_parse(context, text, sizeof text - 1, "bad.yaml", NULL, &none), SEL_ERROR_INPUT);
    assert_int_equal(sel_fault_count(context), 3);
    expect_fault("bad.yaml:");
    bool has_section = false, has_key = false;
    for (int i = 0; i < 3; i++) {
        has_section |= strstr(sel_fault(context, i), "bad.yaml:3:") && strstr(sel_fault(context, i), "length_mm");
        has_key |= strstr(sel_fault(context, i), "bad.yaml:4:") && strstr(sel_fault(context, i), "sheat");
    }
    assert_true(has_section && has_key);
    assert_string_equal(sel_fault(context, 3), "");
    assert_string_equal(sel_fault(context, -1), "");
    SelOpenOptions options = sel_open_defaults();
    options.contact = "msh";
    assert_int_equal(sel_scene_open(context, phantom, &options, &none), SEL_ERROR_INPUT);
    expect_fault("unknown contact 'msh'; expected lim,");
    // the next call with the context has none
    SelSimulator *simulator = new_simulator(scene);
    assert_int_equal(sel_fault_count(context), 0);
    sel_simulator_destroy(simulator);
}

static void a_bad_hand_moves_nothing(void **state)
{
    (void)state;
    SelSimulator *simulator = new_simulator(scene);
    uint64_t before = sel_simulator_hash(simulator);
    SelHand hand[5] = {0};
    hand[0].tool[0].push_mm_s = NAN;
    hand[1].tool[0].push_mm_s = 1001;
    hand[2].tool[3].twist_deg_s = -INFINITY;
    hand[3].contrast_ml_s = -1;
    hand[4].tool[0].device = 5;
    for (int i = 0; i < 5; i++) {
        assert_int_equal(sel_simulator_step(simulator, &hand[i]), SEL_ERROR_ARGUMENT);
        expect_fault("sel_simulator_step: ");
    }
    assert_true(sel_simulator_hash(simulator) == before && sel_simulator_steps(simulator) == 0);
    sel_simulator_destroy(simulator);
}

// --- settings of the host are unchanged ---

static void the_host_keeps_its_settings(void **state)
{
    (void)state;
    H5E_auto2_t handler, after;
    void *data, *data_after;
    unsigned plugins = 0, plugins_after = 1;
    SelScene *none = NULL;
    SelRecording *recording = NULL;
    H5open();
    H5Eget_auto2(H5E_DEFAULT, &handler, &data);
    H5PLget_loading_state(&plugins);
    assert_non_null(handler);
    char path[600];
    snprintf(path, sizeof path, "%s", in_folder("kept.h5"));
    SelSimulator *simulator = new_simulator(scene);
    good(sel_simulator_record(simulator, path, NULL));
    good(sel_simulator_step(simulator, NULL));
    good(sel_simulator_end_recording(simulator));
    sel_simulator_destroy(simulator);
    good(sel_recording_open(context, path, &recording));
    sel_recording_destroy(recording);
    assert_int_equal(sel_recording_open(context, phantom, &recording), SEL_ERROR_INPUT);
    assert_int_equal(sel_scene_open(context, path, NULL, &none), SEL_ERROR_INPUT);
    H5Eget_auto2(H5E_DEFAULT, &after, &data_after);
    H5PLget_loading_state(&plugins_after);
    assert_true(after == handler && data_after == data && plugins_after == plugins);
}

// --- the simulation ---

static void two_simulators_in_turn_are_two_alone(void **state)
{
    (void)state;
    enum { STEPS = WHOLE_OR_SHORT(400, 100) };
    SelOpenOptions slow = sel_open_defaults();
    SelScene *other = NULL;
    slow.script = SOURCE_DIR "/scenes/phantom/slow.csv";
    good(sel_scene_open(context, phantom, &slow, &other));
    SelSimulator *a = new_simulator(scene), *b = new_simulator(other);
    for (int i = 0; i < STEPS; i++) {
        step_by_script(a, 1);
        step_by_script(b, 1);
    }
    assert_true(sel_simulator_hash(a) == hash_after(scene, STEPS));
    assert_true(sel_simulator_hash(b) == hash_after(other, STEPS));
    assert_true(sel_simulator_hash(a) != sel_simulator_hash(b));
    sel_scene_destroy(other);
    sel_simulator_destroy(a);
    sel_simulator_destroy(b);
}

enum { SHARED_STEPS = WHOLE_OR_SHORT(300, 100) };

static void *run_alone(void *hash)
{
    SelContext *own = NULL;
    SelSimulator *simulator = NULL;
    SelHand hand;
    bool is_good = sel_context_create(NULL, &own) == SEL_OK && sel_simulator_create(own, scene, NULL, &simulator) == SEL_OK;
    sel_context_destroy(own);        // the simulator keeps it
    for (int i = 0; is_good && i < SHARED_STEPS; i++)
        is_good = sel_simulator_script_hand(simulator, &hand) == SEL_OK && sel_simulator_step(simulator, &hand) == SEL_OK;
    *(uint64_t *)hash = is_good ? sel_simulator_hash(simulator) : 0;
    sel_simulator_destroy(simulator);
    return NULL;
}

static void threads_share_a_scene(void **state)
{
    (void)state;
    pthread_t thread[2];
    uint64_t hash[2] = {0};
    for (int i = 0; i < 2; i++)
        assert_int_equal(pthread_create(&thread[i], NULL, run_alone, &hash[i]), 0);
    for (int i = 0; i < 2; i++)
        pthread_join(thread[i], NULL);
    uint64_t alone = hash_after(scene, SHARED_STEPS);
    assert_true(hash[0] == alone && hash[1] == alone);
}

// The phantom's scene, in code.
static SelScene *build_phantom(double first_push, double inserted_mm)
{
    const SelSection section[] = {
        {.length_mm = 270, .diameter_mm = 0.36, .young_modulus_gpa = 80, .poisson_ratio = 0.3, .density_g_cm3 = 6.45},
        {.length_mm = 30, .diameter_mm = 0.36, .young_modulus_gpa = 5, .poisson_ratio = 0.3, .density_g_cm3 = 6.45, .rest_curvature_1_mm = 0.1},
    };
    const SelScriptRow row[] = {{.t_s = 0, .tool = {{.push_mm_s = first_push}}}, {.t_s = 10}};
    SelVesselOptions vessel = sel_vessel_defaults();
    vessel.source = SEL_VESSEL_SHAPE;
    vessel.name = "phantom";
    vessel.friction = 0.04;
    SelToolOptions wire = sel_tool_defaults();
    wire.section_count = 2;
    wire.section = section;
    wire.elements = 200;
    wire.inserted_mm = inserted_mm;
    wire.damping_mass_1_s = 0.1;
    wire.damping_stiffness_s = 0.0002;
    SelSceneOptions options = sel_scene_defaults();
    options.vessel = &vessel;
    options.tool_count = 1;
    options.tool = &wire;
    options.row_count = 2;
    options.row = row;
    SelScene *built = NULL;
    good(sel_scene_build(context, &options, NULL, &built));
    return built;
}

// A decimal comma, in a locale made for the test.
static void the_host_may_speak_german(void **state)
{
    (void)state;
    char command[400];
    snprintf(command, sizeof command, "localedef -i de_DE -f UTF-8 '%s/de_DE.utf8' >/dev/null 2>&1", folder);
    bool is_made = system(command) == 0;
    setenv("LOCPATH", folder, 1);
    if (!is_made || !setlocale(LC_NUMERIC, "de_DE.utf8")) {
        unsetenv("LOCPATH");
        print_message("skipped: no localedef, or no source of de_DE\n");
        skip();
    }
    static const char bend[] = SOURCE_DIR "/scenes/verify/push-through-bend.yaml";
    SelScene *here = NULL, *same = NULL, *built = NULL;
    assert_string_equal(localeconv()->decimal_point, ",");
    SelStatus status = sel_scene_open(context, bend, NULL, &same);
    built = build_phantom(17.3, 2);
    assert_string_equal(localeconv()->decimal_point, ",");
    setlocale(LC_NUMERIC, "C");
    unsetenv("LOCPATH");
    good(status);
    good(sel_scene_open(context, bend, NULL, &here));
    assert_true(hash_after(same, WHOLE_OR_SHORT(1200, 100)) == hash_after(here, WHOLE_OR_SHORT(1200, 100)));
    assert_non_null(strstr(sel_scene_text(built), "push_mm_s\": 17.300000000000001"));
    sel_scene_destroy(here);
    sel_scene_destroy(same);
    sel_scene_destroy(built);
}

// The same scene from a file and from structures gives bit-identical results.
static void a_scene_in_code_is_that_of_the_file(void **state)
{
    (void)state;
    enum { STEPS = WHOLE_OR_SHORT(500, 100) };
    SelSimulator *by_file = new_simulator(scene);
    SelHand hand = {.tool = {{.push_mm_s = 17.3}}};
    for (int i = 0; i < STEPS; i++)
        good(sel_simulator_step(by_file, &hand));
    SelScene *built = build_phantom(17.3, 2);
    assert_string_equal(sel_scene_tool_name(built, 0), "tool1");
    assert_true(sel_scene_tool_count(built) == 1 && sel_scene_tool_name(built, 1) == NULL);
    assert_true(fabs(sel_scene_script_s(built) - 10) < 1e-12 && fabs(sel_scene_step_s(built) - 0.001) < 1e-15);
    assert_true(hash_after(built, STEPS) == sel_simulator_hash(by_file));
    sel_simulator_destroy(by_file);
    sel_scene_destroy(built);
}

static void faults_of_a_scene_in_code_are_reported(void **state)
{
    (void)state;
    SelSceneOptions options = sel_scene_defaults();
    SelScene *none = NULL;
    assert_int_equal(sel_scene_build(context, &options, NULL, &none), SEL_ERROR_ARGUMENT);
    expect_fault("1 to 4 tools");
    SelSection section = {.length_mm = 100, .diameter_mm = NAN, .young_modulus_gpa = 80, .density_g_cm3 = 6.45};
    SelToolOptions wire = sel_tool_defaults();
    wire.section_count = 1;
    wire.section = &section;
    options.tool_count = 1;
    options.tool = &wire;
    options.is_at_inlet = 0;
    assert_int_equal(sel_scene_build(context, &options, NULL, &none), SEL_ERROR_ARGUMENT);
    expect_fault("not finite");
    section.diameter_mm = 0.36;
    section.inner_diameter_mm = 0.5;
    assert_int_equal(sel_scene_build(context, &options, NULL, &none), SEL_ERROR_INPUT);
    expect_fault("scene.yaml:");
    wire.name = "a \"quoted\\ name\n";
    assert_int_equal(sel_scene_build(context, &options, NULL, &none), SEL_ERROR_INPUT);
    assert_null(none);
}

// In a straight tube without friction the wire is where the hand has pushed it, and the wall's gap is known everywhere.
static void a_tube_in_code_is_a_tube(void **state)
{
    (void)state;
    const SelPiece piece[] = {{.length_mm = 100}};
    const SelSection section = {.length_mm = 150, .diameter_mm = 0.4, .young_modulus_gpa = 60, .poisson_ratio = 0.3, .density_g_cm3 = 6.45};
    SelVesselOptions vessel = sel_vessel_defaults();
    vessel.source = SEL_VESSEL_TUBE;
    vessel.radius_mm = 2;
    vessel.piece_count = 1;
    vessel.piece = piece;
    SelToolOptions wire = sel_tool_defaults();
    wire.name = "wire";
    wire.section_count = 1;
    wire.section = &section;
    wire.inserted_mm = 5;
    SelSceneOptions options = sel_scene_defaults();
    options.vessel = &vessel;
    options.tool_count = 1;
    options.tool = &wire;
    SelScene *tube = NULL;
    good(sel_scene_build(context, &options, NULL, &tube));
    SelSimulator *simulator = new_simulator(tube);
    const SelHand hand = {.tool = {{.push_mm_s = 20}}};
    for (int i = 0; i < 1000; i++)
        good(sel_simulator_step(simulator, &hand));
    double tip[3], gap[3], normal[9], point[] = {50, 0, 0, 50, 1.5, 0, 50, 0, -2.5}, entry[3], direction[3];
    good(sel_simulator_tip(simulator, 0, tip));
    assert_true(fabs(tip[0] - 25) < 1e-3 && fabs(tip[1]) < 1e-3 && fabs(tip[2]) < 1e-3);
    good(sel_scene_query(context, tube, 3, point, gap, normal));
    assert_true(fabs(gap[0] - 2) < 1e-9 && fabs(gap[1] - 0.5) < 1e-9 && fabs(gap[2] + 0.5) < 1e-9);
    assert_true(fabs(normal[4] + 1) < 1e-9 && fabs(normal[8] - 1) < 1e-9);
    good(sel_scene_entry(tube, entry, direction));
    assert_true(fabs(entry[0]) < 1e-12 && fabs(direction[0] - 1) < 1e-12);
    point[0] = NAN;
    assert_int_equal(sel_scene_query(context, tube, 1, point, gap, NULL), SEL_ERROR_ARGUMENT);
    sel_scene_destroy(tube);         // the simulator keeps it
    good(sel_simulator_step(simulator, &hand));
    sel_simulator_destroy(simulator);
}

// Values read in different ways are consistent.
static void what_is_read_agrees(void **state)
{
    (void)state;
    enum { STEPS = WHOLE_OR_SHORT(2500, 1800), ROOM = 400 };      // of both the wire presses on the wall, and has gone 10 mm
    SelSimulator *simulator = new_simulator(scene);
    step_by_script(simulator, STEPS);
    uint64_t before = sel_simulator_hash(simulator);
    SelReport report;
    SelScore score;
    SelTargetReach reach;
    static SelNode node[ROOM];
    static SelContact contact[ROOM];
    int nodes = 0, contacts = 0, few = 0;
    double tip[3], sum = 0, most = 0;
    good(sel_simulator_report(simulator, &report, sizeof report));
    assert_true(report.size == sizeof report && report.contacts > 0 && report.push_n[0] < 0);
    assert_true(sel_simulator_steps(simulator) == STEPS && fabs(sel_simulator_time_s(simulator) - 0.001 * STEPS) < 1e-12);
    assert_int_equal(sel_simulator_node_capacity(simulator, 0), 201);
    assert_int_equal(sel_simulator_node_capacity(simulator, 1), 0);
    good(sel_simulator_nodes(simulator, 0, node, ROOM, &nodes));
    good(sel_simulator_tip(simulator, 0, tip));
    assert_int_equal(nodes, 201);
    assert_true(memcmp(tip, node[200].position_mm, sizeof tip) == 0 && fabs(node[200].s_mm - 300) < 1e-9 && node[0].carrier == -1 && node[200].carrier == 0);
    assert_int_equal(sel_simulator_nodes(simulator, 0, node, 10, &nodes), SEL_ERROR_ARGUMENT);
    expect_fault("sel_simulator_node_capacity()");
    good(sel_simulator_contacts(simulator, contact, ROOM, &contacts));
    good(sel_simulator_contacts(simulator, NULL, 0, &few));
    assert_true(contacts == few && contacts <= ROOM);
    for (int i = 0; i < contacts; i++) {
        double f =
            sqrt(contact[i].force_n[0] * contact[i].force_n[0] + contact[i].force_n[1] * contact[i].force_n[1] + contact[i].force_n[2] * contact[i].force_n[2]);
        sum += f;
        most = fmax(most, f);
    }
    assert_true(fabs(sum - report.wall_force_sum_n) < 1e-6 * sum && fabs(most - report.wall_force_max_n) < 1e-6 * most);
    assert_int_equal(sel_simulator_target_count(simulator), 1);
    good(sel_simulator_target(simulator, 0, &reach));
    assert_true(reach.distance_mm > 0 && !reach.is_reached);
    assert_int_equal(sel_simulator_target(simulator, 1, &reach), SEL_ERROR_ARGUMENT);
    good(sel_simulator_score(simulator, &score, sizeof score));
    assert_true(score.state == SEL_SCORE_RUNNING && score.path_mm > 10 && fabs(score.inserted_mm - (report.inserted_mm[0] - 2)) < 1e-6);
    assert_true(score.wall_force_peak_n >= report.wall_force_max_n);
    char *json = NULL;
    good(sel_simulator_score_json(simulator, &json));
    assert_non_null(strstr(json, "\"wall_force_peak_n\""));
    sel_free(json);
    assert_true(sel_simulator_hash(simulator) == before);
    sel_simulator_destroy(simulator);
}

// A program of another version of the header has shorter or longer structures.
static void structures_may_grow(void **state)
{
    (void)state;
    struct {
        SelReport report;
        char later[64];
    } longer;
    SelReport whole;
    SelSimulator *simulator = new_simulator(scene);
    step_by_script(simulator, 50);
    good(sel_simulator_report(simulator, &whole, sizeof whole));
    memset(&longer, 1, sizeof longer);
    good(sel_simulator_report(simulator, &longer.report, sizeof longer));
    assert_true(longer.report.size == sizeof longer && longer.report.iterations == whole.iterations && longer.later[0] == 0 && longer.later[63] == 0);
    SelReport shorter;
    memset(&shorter, 1, sizeof shorter);
    good(sel_simulator_report(simulator, &shorter, offsetof(SelReport, contacts)));
    assert_true(shorter.flags == whole.flags && shorter.contacts == 0x01010101);
    sel_simulator_destroy(simulator);
    SelSimulatorOptions options = {.size = offsetof(SelSimulatorOptions, keeps_score)};       // an older structure: the default is used
    SelScore score;
    good(sel_simulator_create(context, scene, &options, &simulator));
    good(sel_simulator_score(simulator, &score, sizeof score));
    sel_simulator_destroy(simulator);
    options = sel_simulator_defaults();
    options.keeps_score = 0;
    good(sel_simulator_create(context, scene, &options, &simulator));
    assert_int_equal(sel_simulator_score(simulator, &score, sizeof score), SEL_ERROR_STATE);
    sel_simulator_destroy(simulator);
}

// --- recording and replay ---

static void a_recording_is_replayed_bit_for_bit(void **state)
{
    (void)state;
    enum { STEPS = WHOLE_OR_SHORT(700, 200) };       // four times: as simulated, verified, by hand, and from another start
    char path[600];
    snprintf(path, sizeof path, "%s", in_folder("run.h5"));
    SelScene *built = build_phantom(25, 2), *again = NULL;
    SelSimulator *simulator = new_simulator(built);
    good(sel_simulator_record(simulator, path, NULL));
    assert_int_equal(sel_simulator_record(simulator, path, NULL), SEL_ERROR_STATE);
    step_by_script(simulator, STEPS);
    SelReport report;
    good(sel_simulator_report(simulator, &report, sizeof report));
    good(sel_simulator_end_recording(simulator));
    assert_int_equal(sel_simulator_end_recording(simulator), SEL_ERROR_STATE);
    assert_int_equal(sel_simulator_record(simulator, path, NULL), SEL_ERROR_STATE);
    uint64_t last = sel_simulator_hash(simulator), hash = 0;
    sel_simulator_destroy(simulator);
    sel_scene_destroy(built);

    SelRecording *recording = NULL;
    SelVerdict verdict;
    double push = 0, points[3 * 201];
    int count = 0;
    int64_t step = -1;
    good(sel_recording_open(context, path, &recording));
    assert_true(sel_recording_steps(recording) == STEPS && sel_recording_tool_count(recording) == 1 && sel_recording_frames(recording) >= STEPS / 10);
    good(sel_recording_hash(recording, STEPS - 1, &hash));
    good(sel_recording_force(recording, STEPS - 1, 0, &push, NULL));
    assert_true(hash == last && !(push < report.push_n[0]) && !(push > report.push_n[0]));
    good(sel_recording_frame(recording, sel_recording_frames(recording) - 1, &step, points, 201, &count));
    assert_true(step == STEPS - 1 && count == 201);
    assert_int_equal(sel_recording_hash(recording, STEPS, &hash), SEL_ERROR_ARGUMENT);
    good(sel_recording_scene(context, recording, NULL, &again));
    good(sel_recording_verify(context, recording, again, &verdict));
    assert_true(verdict.steps == STEPS && verdict.first_different == -1 && verdict.simulated == last);
    // by hand: the recorded commands
    simulator = new_simulator(again);
    for (int i = 0; i < STEPS; i++) {
        SelHand hand;
        good(sel_recording_hand(recording, i, &hand));
        good(sel_simulator_step(simulator, &hand));
        good(sel_recording_hash(recording, i, &hash));
        assert_true(sel_simulator_hash(simulator) == hash);
    }
    sel_simulator_destroy(simulator);
    // another start is another run
    SelScene *other = build_phantom(25, 2.001);
    assert_int_equal(sel_recording_verify(context, recording, other, &verdict), SEL_DIFFERENT);
    assert_true(verdict.first_different == 0 && verdict.recorded != verdict.simulated);
    sel_scene_destroy(other);
    sel_scene_destroy(again);
    sel_recording_destroy(recording);
}

static void an_unwritable_recording_is_an_error(void **state)
{
    (void)state;
    SelSimulator *simulator = new_simulator(scene);
    assert_int_equal(sel_simulator_record(simulator, "/nowhere/run.h5", NULL), SEL_ERROR_OUTPUT);
    expect_fault("/nowhere/run.h5: cannot be recorded");
    good(sel_simulator_step(simulator, NULL));
    sel_simulator_destroy(simulator);
}

// --- reconstruction ---

enum { SIZE = 36, LENGTH = 60 };
static const double edge_mm = 0.5, radius_mm = 2;

// A bright cylinder along z, whose edge is blurred like an average over voxels.
static SelVolume *cylinder(void)
{
    static float value[LENGTH][SIZE][SIZE];
    const int size[3] = {SIZE, SIZE, LENGTH};
    const double origin[3] = {0, 0, 0}, axis[3][3] = {{edge_mm, 0, 0}, {0, edge_mm, 0}, {0, 0, edge_mm}}, middle = edge_mm * (SIZE - 1) / 2;
    for (int k = 0; k < LENGTH; k++)
        for (int j = 0; j < SIZE; j++)
            for (int i = 0; i < SIZE; i++) {
                double inside = radius_mm - hypot(edge_mm * i - middle, edge_mm * j - middle);
                value[k][j][i] = (float)(1000 * fmin(1, fmax(0, 0.5 + inside / edge_mm)));
            }
    SelVolume *volume = NULL;
    good(sel_volume_create(context, size, origin, axis, &value[0][0][0], &volume));
    return volume;
}

static void a_volume_becomes_a_model(void **state)
{
    (void)state;
    SelVolume *volume = cylinder();
    SelSegmentOptions options = sel_segment_defaults();
    SelTree *tree = NULL, *model = NULL, *loaded = NULL;
    SelTreeNode node;
    int size[3];
    const double middle = edge_mm * (SIZE - 1) / 2, at[3] = {middle, middle, 15};
    good(sel_volume_size(volume, size));
    assert_true(size[2] == LENGTH && fabs(sel_volume_voxel_mm(volume) - edge_mm) < 1e-12);
    memcpy(options.start_mm, at, sizeof at);
    good(sel_segment(context, volume, &options, &tree));
    assert_true(sel_tree_node_count(tree) > 3 && sel_tree_point_count(tree) > 100 && !sel_tree_is_model(tree));
    good(sel_tree_node(tree, 0, &node));
    assert_true(node.parent == -1 && !node.is_aneurysm && fabs(node.radius_mm - radius_mm) < 0.2);
    double gap = 0, same = 0, normal[3];
    assert_int_equal(sel_tree_query(context, tree, 1, at, &gap, NULL), SEL_ERROR_STATE);
    good(sel_fit(context, tree, NULL, &model));
    good(sel_tree_query(context, model, 1, at, &gap, normal));
    assert_true(sel_tree_is_model(model) && fabs(gap - radius_mm) < 0.05);
    char path[600];
    snprintf(path, sizeof path, "%s", in_folder("model.h5"));
    good(sel_tree_save(context, model, path));
    good(sel_tree_open(context, path, &loaded));
    good(sel_tree_query(context, loaded, 1, at, &same, NULL));
    assert_memory_equal(&gap, &same, sizeof gap);
    const double nowhere[3] = {1, 1, 1};
    SelTree *none = NULL;
    memcpy(options.start_mm, nowhere, sizeof nowhere);
    assert_int_equal(sel_segment(context, volume, &options, &none), SEL_ERROR_INPUT);
    expect_fault("start_mm");
    assert_null(none);
    sel_tree_destroy(loaded);
    sel_tree_destroy(model);
    sel_tree_destroy(tree);
    sel_volume_destroy(volume);
}

static void call_program(const char *arguments)
{
    char command[2000];
    snprintf(command, sizeof command, "cd '%s' && '%s' %s", folder, SELDINGER_PROGRAM, arguments);
    if (system(command) != 0)
        fail_msg("failed: %s", arguments);
}

static void expect_same_file(const char *one, const char *other)
{
    char command[1000];
    snprintf(command, sizeof command, "cmp '%s' '%s'", in_folder(one), in_folder(other));
    assert_int_equal(system(command), 0);
}

// The verbs and the library write byte-identical trees and models, including the attributes about their origin.
static void files_are_those_of_the_program(void **state)
{
    (void)state;
    SelVolume *volume = NULL;
    SelTree *tree = NULL, *model = NULL;
    SelSegmentOptions options = sel_segment_defaults();
    char here[1000];
    call_program("synth y --length-mm 6 --noise 0.05 -o y.nrrd --quiet");
    call_program("segment y.nrrd --start=-3,0,0 -o y.h5 --quiet");
    call_program("fit y.h5 -o y-model.h5 --quiet");
    assert_non_null(getcwd(here, sizeof here));
    assert_int_equal(chdir(folder), 0);
    SelStatus status = sel_volume_open(context, "y.nrrd", &volume);
    assert_int_equal(chdir(here), 0);
    good(status);
    options.start_mm[0] = -3;
    options.threads = 2;
    good(sel_segment(context, volume, &options, &tree));
    good(sel_fit(context, tree, NULL, &model));
    good(sel_tree_save(context, tree, in_folder("own.h5")));
    good(sel_tree_save(context, model, in_folder("own-model.h5")));
    expect_same_file("y.h5", "own.h5");
    expect_same_file("y-model.h5", "own-model.h5");
    sel_tree_destroy(model);
    sel_tree_destroy(tree);
    sel_volume_destroy(volume);
}

static void bad_volumes_are_refused(void **state)
{
    (void)state;
    const int size[3] = {2, 2, 2}, none[3] = {2, 0, 2};
    const double origin[3] = {0}, axis[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, flat[3][3] = {{1, 0, 0}, {0, 1, 0}, {1, 1, 0}};
    const float value[8] = {0, 0, 0, NAN};
    SelVolume *volume = NULL;
    assert_int_equal(sel_volume_create(context, none, origin, axis, value, &volume), SEL_ERROR_ARGUMENT);
    assert_int_equal(sel_volume_create(context, size, origin, flat, value, &volume), SEL_ERROR_ARGUMENT);
    assert_int_equal(sel_volume_create(context, size, origin, axis, value, &volume), SEL_ERROR_ARGUMENT);
    expect_fault("value 3 is not finite");
    assert_null(volume);
}

static void versions_and_names(void **state)
{
    (void)state;
    char version[40];
    snprintf(version, sizeof version, "%d.%d.%d", SEL_VERSION_MAJOR, SEL_VERSION_MINOR, SEL_VERSION_PATCH);
    assert_string_equal(sel_version(), version);
    for (int i = SEL_OK; i <= SEL_DIFFERENT; i++)
        assert_string_not_equal(sel_status_name((SelStatus)i), "unknown");
    assert_string_equal(sel_status_name((SelStatus)(SEL_DIFFERENT + 1)), "unknown");
}

// --- again and beside ---

static SelSimulator *without_score(void)
{
    SelSimulator *simulator = NULL;
    SelSimulatorOptions options = sel_simulator_defaults();
    options.keeps_score = 0;
    good(sel_simulator_create(context, scene, &options, &simulator));
    return simulator;
}

static void a_reset_is_a_new_beginning(void **state)
{
    (void)state;
    SelSimulator *simulator = new_simulator(scene);
    SelScore score, again;
    good(sel_simulator_follow(simulator, 300));
    assert_true(sel_simulator_hash(simulator) == hash_after(scene, 300));
    good(sel_simulator_score(simulator, &score, sizeof score));
    good(sel_simulator_reset(simulator));
    assert_int_equal(sel_simulator_steps(simulator), 0);
    assert_true(sel_simulator_hash(simulator) == hash_after(scene, 0));
    good(sel_simulator_follow(simulator, 300));
    assert_true(sel_simulator_hash(simulator) == hash_after(scene, 300));
    good(sel_simulator_score(simulator, &again, sizeof again));
    assert_memory_equal(&score, &again, sizeof score);
    sel_simulator_destroy(simulator);
    simulator = new_simulator(scene);
    good(sel_simulator_record(simulator, in_folder("reset.h5"), NULL));
    assert_int_equal(sel_simulator_reset(simulator), SEL_ERROR_STATE);
    sel_simulator_destroy(simulator);
}

static void a_copy_goes_on_alike(void **state)
{
    (void)state;
    SelSimulator *from = without_score(), *to = without_score(), *scored = new_simulator(scene);
    const SelHand hand = {.tool = {{.push_mm_s = 25, .twist_deg_s = -90}}};
    SelTargetReach reach[2];
    good(sel_simulator_follow(from, 400));
    good(sel_simulator_repeat(to, &hand, 100));
    good(sel_simulator_copy(to, from));
    good(sel_simulator_repeat(from, &hand, 200));
    for (int i = 0; i < 200; i++)
        good(sel_simulator_step(to, &hand));
    assert_true(sel_simulator_hash(to) == sel_simulator_hash(from));
    good(sel_simulator_target(from, 0, &reach[0]));
    good(sel_simulator_target(to, 0, &reach[1]));
    assert_true(reach[0].distance_mm == reach[1].distance_mm && reach[0].time_s == reach[1].time_s);
    assert_int_equal(sel_simulator_copy(scored, from), SEL_ERROR_STATE);
    assert_int_equal(sel_simulator_repeat(from, &hand, -1), SEL_ERROR_ARGUMENT);
    sel_simulator_destroy(from);
    sel_simulator_destroy(to);
    sel_simulator_destroy(scored);
}

static void the_centreline_is_the_state(void **state)
{
    (void)state;
    enum { NODES = 201 };
    SelSimulator *simulator = new_simulator(scene);
    const double *position = NULL, *quaternion = NULL;
    SelNode node[NODES];
    int count = 0, nodes = 0;
    good(sel_simulator_centreline(simulator, &position, &quaternion, &count));
    good(sel_simulator_follow(simulator, 500));
    good(sel_simulator_nodes(simulator, 0, node, NODES, &nodes));
    assert_int_equal(count, nodes);
    for (int i = 0; i < count; i++) {
        assert_memory_equal(position + 3 * i, node[i].position_mm, sizeof node[i].position_mm);
        assert_memory_equal(quaternion + 4 * i, node[i].quaternion, sizeof node[i].quaternion);
    }
    sel_simulator_destroy(simulator);
}

static void targets_are_the_scenes(void **state)
{
    (void)state;
    SelTarget target;
    assert_int_equal(sel_scene_target_count(scene), 1);
    good(sel_scene_target(scene, 0, &target));
    assert_string_equal(target.name, "middle cerebral artery");
    assert_true(target.radius_mm == 2 && target.point_mm[0] == 23.9);
    assert_int_equal(sel_scene_target(scene, 1, &target), SEL_ERROR_ARGUMENT);
}

static void the_centrelines_are_in_the_vessel(void **state)
{
    (void)state;
    int count = sel_scene_node_count(scene);
    assert_true(count > 100);
    for (int i = 0; i < count; i++) {
        SelTreeNode node;
        double gap;
        good(sel_scene_node(scene, i, &node));
        assert_true(node.parent < i && (i > 0) == (node.parent >= 0));
        good(sel_scene_query(context, scene, 1, node.center_mm, &gap, NULL));
        assert_true(gap > 0.3 * node.radius_mm && gap < 1.7 * node.radius_mm);
    }
    SelTreeNode none;
    assert_int_equal(sel_scene_node(scene, count, &none), SEL_ERROR_ARGUMENT);
}

static void a_scene_takes_other_values(void **state)
{
    (void)state;
    char *first = NULL, *text = NULL;
    good(sel_scene_text_with(context, sel_scene_text(scene), "targets.0.point_mm", "[1, 2.5, -3]", &first));
    good(sel_scene_text_with(context, first, "simulation", "{step_ms: 2}", &text)); // a key that the scene lacks
    SelScene *other = NULL;
    SelTarget target;
    good(sel_scene_parse(context, text, strlen(text), phantom, NULL, &other));
    good(sel_scene_target(other, 0, &target));
    assert_true(target.point_mm[0] == 1 && target.point_mm[1] == 2.5 && target.point_mm[2] == -3 && target.radius_mm == 2);
    assert_true(sel_scene_step_s(other) == 0.002);
    sel_scene_destroy(other);
    sel_free(first);
    sel_free(text);
    const char *const wrong[][2] = {
        {"targets.7.point_mm", "[1, 2, 3]"}, {"vessel.colour.red", "1"}, {"vessel.friction", "[1, 2"}, {"vessel.friction", "1\nx: 2"}};
    for (int i = 0; i < 4; i++) {
        assert_int_equal(sel_scene_text_with(context, sel_scene_text(scene), wrong[i][0], wrong[i][1], &text), SEL_ERROR_INPUT);
        assert_non_null(strstr(sel_fault(context, 0), wrong[i][0]));
    }
}

// --- many at once ---

static void a_batch_is_its_simulators_alone(void **state)
{
    (void)state;
    enum { COUNT = 5, STEPS = 60 };
    const SelScene *scenes[COUNT] = {scene, scene, scene, scene, scene};
    SelHand hand[COUNT] = {0};
    uint64_t alone[COUNT];
    for (int i = 0; i < COUNT; i++) {
        hand[i].tool[0] = (SelCommand){.push_mm_s = 10 * i, .twist_deg_s = 50};
        SelSimulator *simulator = new_simulator(scene);
        good(sel_simulator_repeat(simulator, &hand[i], STEPS));
        alone[i] = sel_simulator_hash(simulator);
        sel_simulator_destroy(simulator);
    }
    for (int threads = 1; threads <= 4; threads++) {
        SelBatchOptions options = sel_batch_defaults();
        SelBatch *batch = NULL;
        options.threads = threads;
        good(sel_batch_create(context, COUNT, scenes, &options, &batch));
        good(sel_batch_hashes(batch, 1));
        for (int k = 0; k < STEPS / 10; k++)
            good(sel_batch_step(batch, hand, 10, NULL));
        const SelBatchRow *row = sel_batch_rows(batch);
        for (int i = 0; i < COUNT; i++) {
            double tip[3];
            assert_true(row[i].hash == alone[i]);
            good(sel_simulator_tip(sel_batch_simulator(batch, i), 0, tip));
            assert_memory_equal(tip, row[i].tip_mm, sizeof tip);
        }
        assert_null(sel_batch_simulator(batch, COUNT));
        hand[3].tool[0].push_mm_s = 1e6;
        assert_int_equal(sel_batch_step(batch, hand, 1, NULL), SEL_ERROR_ARGUMENT);
        expect_fault("simulator 3: push_mm_s");
        assert_true(row[0].time_s == 0.06);
        hand[3].tool[0].push_mm_s = 30;
        sel_batch_destroy(batch);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(versions_and_names),
        cmocka_unit_test(wrong_arguments_are_refused),
        cmocka_unit_test(missing_files_are_named),
        cmocka_unit_test(faults_have_their_place),
        cmocka_unit_test(a_bad_hand_moves_nothing),
        cmocka_unit_test(the_host_keeps_its_settings),
        cmocka_unit_test(the_host_may_speak_german),
        cmocka_unit_test(two_simulators_in_turn_are_two_alone),
        cmocka_unit_test(threads_share_a_scene),
        cmocka_unit_test(a_scene_in_code_is_that_of_the_file),
        cmocka_unit_test(faults_of_a_scene_in_code_are_reported),
        cmocka_unit_test(a_tube_in_code_is_a_tube),
        cmocka_unit_test(what_is_read_agrees),
        cmocka_unit_test(structures_may_grow),
        cmocka_unit_test(a_recording_is_replayed_bit_for_bit),
        cmocka_unit_test(an_unwritable_recording_is_an_error),
        cmocka_unit_test(a_reset_is_a_new_beginning),
        cmocka_unit_test(a_copy_goes_on_alike),
        cmocka_unit_test(the_centreline_is_the_state),
        cmocka_unit_test(targets_are_the_scenes),
        cmocka_unit_test(the_centrelines_are_in_the_vessel),
        cmocka_unit_test(a_scene_takes_other_values),
        cmocka_unit_test(a_batch_is_its_simulators_alone),
        cmocka_unit_test(a_volume_becomes_a_model),
        cmocka_unit_test(files_are_those_of_the_program),
        cmocka_unit_test(bad_volumes_are_refused),
    };
    return cmocka_run_group_tests(tests, open_phantom, close_phantom);
}
