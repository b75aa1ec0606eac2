#include "render/trainer.h"

#include "input/input.h"
#include "render/gl_canvas.h"
#include "render/instructor_view.h"
#include "render/png_file.h"
#include "render/pulse_clock.h"
#include "render/redraw.h"
#include "render/scene_views.h"
#include "render/trainer_cine.h"
#include "render/trainer_panel.h"
#include "render/trainer_tray.h"
#include "sim/sim.h"
#include "render/translation.h"

#include <pthread.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

enum { PADS = 4 };
// A window that draws slowly still answers sooner; after this time nobody sees what his hand does.
static const double PATIENCE_S = 1;

typedef struct Trainer {
    const TrainerOptions *options;
    Scene *scene;
    Scene *own_scene;                // owned copy behind `scene` after devices were added from the tray
    int own_devices[TOOLS_MOST];     // number of devices in the caller's scene
    OpenVessel *open;
    Window *window;
    Panel *panel;
    Views *views;
    OperatorControls controls;
    HandPort keyboard[2], pad[PADS][MAP_HANDS];  // keyboard: for the selected tool and its partner
    bool pad_refused[PADS];
    Gamepad gamepad[PADS];
    DeviceMap *built_in[2];          // one for gamepads, one for joysticks
    Hands *hands;
    unsigned buttons;                // of all devices, in the last frame
    LiveSession session;
    TrainerPanel shown;
    PulseClock pulses;
    TrainerCine cine;
    double begun_s;                  // wall clock at the start
    double swapped_s;                // when the window last answered: with a frame, or by finding that none was due
    Redraw redraw;
    double frame_cpu_s;              // process CPU time at the last frame
    XrayControl xray_at_start;       // C-arm, table and mode with which a session begins
    TrainerTray tray;
    bool has_tray, is_tray_due;      // the tray is open; the selected device is inserted after the next picture
    double progress_s;               // time of the last progress update of a resumed session
    int fitted[TOOLS_MOST];          // as last reported, -1: not reported yet
    int64_t refused;
    bool is_paused, has_reported_end;
    char trainee[64];
    char date[SESSION_DATE];         // start of the session
    const char *progress;            // title of the current computation
    TimeHistogram frame_cpu_ns;
    TrainerFigures *figures;
    InstructorView *instructor;      // NULL: none
} Trainer;

static double since_begin(const Trainer *trainer) { return clock_s(CLOCK_MONOTONIC) - trainer->begun_s; }

__attribute__((format(printf, 3, 4))) static void show_message(Trainer *trainer, PanelMark mark, const char *format, ...)
{
    char text[4600];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, tr(format), arguments);
    va_end(arguments);
    panel_message(trainer->panel, since_begin(trainer), mark, text);
}

// --- start and end of a session ---

static void answer(Trainer *trainer)
{
    const double now = since_begin(trainer);
    trainer->figures->longest_gap_s = fmax(trainer->figures->longest_gap_s, trainer->swapped_s > 0 ? now - trainer->swapped_s : 0);
    trainer->swapped_s = now;
}

static void swap(Trainer *trainer)
{
    window_swap(trainer->window);
    answer(trainer);
}

// Draws the panel with a line of text and no views, for use without a session.
static void draw_panel_alone(Trainer *trainer, const WindowInput *input, const char *line)
{
    PanelState state = trainer->shown.state;
    state.warning = line;
    state.warnings = 0;
    state.label_count = 0;
    state.bar_pixels = state.force_full_scale_n = 0;
    state.tray = NULL;
    state.now_s = since_begin(trainer);
    views_draw(trainer->views, &(ViewsFrame){0}, &(PanelLayout){0}, input->width, input->height, 0);
    panel_draw(trainer->panel, input, &state, 0);
    swap(trainer);
}

// Keeps the window responsive while a session is simulated again.
static void show_progress(void *context, double part)
{
    Trainer *trainer = context;
    const WindowInput *input;
    const double now = since_begin(trainer);
    char line[120];
    if (now - trainer->progress_s < 0.1 || !window_next_frame(trainer->window, &input))
        return;
    trainer->progress_s = now;
    snprintf(line, sizeof line, "%s: %.0f %%", trainer->progress, 100 * part);
    draw_panel_alone(trainer, input, line);
}

// Asks the user a question; returns true for yes. Waiting counts towards the time limit of the window.
static bool is_answered_yes(Trainer *trainer, PanelQuestion question)
{
    const WindowInput *input;
    PanelActions actions = {0};
    panel_ask(trainer->panel, question);
    while (panel_is_asking(trainer->panel) && !actions.pressed[ACTION_QUIT] &&
           !(trainer->options->duration_s > 0 && since_begin(trainer) > trainer->options->duration_s)) {
        bool visible = window_next_frame(trainer->window, &input);
        panel_take_input(trainer->panel, input, &actions);
        if (visible)
            draw_panel_alone(trainer, input, NULL);
    }
    return actions.answer > 0;
}

// Offers to recover interrupted sessions before the first session begins.
static void offer_recovery(Trainer *trainer)
{
    char text[300];
    CutOff found = session_find_cut_off(trainer->options->folder);
    Faults *faults = found.count > 0 ? calloc(1, sizeof *faults) : NULL;
    if (faults) {
        const char *slash = strrchr(found.path[found.count - 1], '/');
        snprintf(text, sizeof text,
                 found.count > 1 ? tr("%d sessions were interrupted, the last is %s. Their reports can still be made: the sessions are simulated again.")
                                 : tr("%d session was interrupted: %s. Its report can still be made: the session is simulated again."),
                 found.count, slash ? slash + 1 : "");
        bool wanted = is_answered_yes(trainer, (PanelQuestion){"Recover interrupted sessions?", text, "Recover", "Not now"});
        trainer->progress = "Simulating the session again";
        for (int i = 0; wanted && i < found.count; i++) {
            faults_clear(faults);
            if (recover_session(found.path[i], &(OpenVesselOptions){.note = trainer->options->note}, show_progress, trainer, faults))
                show_message(trainer, MARK_GOOD, "recovered; seldinger report %s", found.path[i]);
            else
                show_message(trainer, MARK_BAD, "%s", faults->text[0]);
        }
    }
    free(faults);
    session_free_cut_off(&found);
}

// The looks at the 3D view that the first `time_s` of a recording count, so that the counter goes on from there.
static float looks_until(const RecordedRun *run, double time_s)
{
    int64_t steps = run && run->xray ? (int64_t)fmin((double)run->step_count, time_s * 1000 / run->step_ms) : 0;
    return steps > 0 ? run->xray[steps - 1].looks : 0;
}

static bool begin_session(Trainer *trainer, const RecordedRun *resume, Faults *faults)
{
    const TrainerOptions *options = trainer->options;
    char path[4096];
    HandPort *hand[2 + MAP_HANDS * (PADS + HANDS_MOST)];
    int count = 0;
    for (int i = 0; i < 2; i++)
        hand[count++] = &trainer->keyboard[i];
    for (int i = 0; i < PADS * MAP_HANDS; i++)
        hand[count++] = &trainer->pad[i / MAP_HANDS][i % MAP_HANDS];
    for (int i = 0; trainer->hands && i < HANDS_MOST * MAP_HANDS; i++)
        hand[count++] = hands_port(trainer->hands, i / MAP_HANDS) + i % MAP_HANDS;
    trainer->controls.grip = (HandGrip){.chosen = trainer->controls.grip.chosen};    // a new session: nothing is locked or released
    trainer->controls.xray.looks = looks_until(resume, resume == options->resume ? options->resume_s : SCRIPT_LONGEST_S);
    session_file_name(options->folder, trainer->scene->path, ".h5", path, sizeof path);
    LiveSessionOptions session = {.record_path = options->is_recorded ? path : NULL,
                                  .trainee = trainer->trainee,
                                  .date = trainer->date,
                                  .hand_count = count,
                                  .hand = hand,
                                  .grip = trainer->controls.grip,
                                  .xray = trainer->controls.xray,
                                  .resume = resume,
                                  .resume_s = resume == options->resume ? options->resume_s : SCRIPT_LONGEST_S,
                                  .paused = trainer->is_paused,
                                  .patience_s = PATIENCE_S,
                                  .progress = trainer->figures->frames > 0 ? show_progress : NULL,
                                  .progress_context = trainer};
    if (!live_session_open(&trainer->session, trainer->scene, trainer->open, &session, faults))
        return false;
    trainer->controls.grip.released = trainer->session.resumed_released;
    memcpy(trainer->controls.grip.fitted, trainer->session.resumed_fitted, sizeof trainer->controls.grip.fitted);
    trainer->pulses = pulse_clock_start(trainer->session.resumed_s);
    trainer->has_reported_end = false;
    for (int k = 0; k < TOOLS_MOST; k++)
        trainer->fitted[k] = -1;
    trainer_panel_begin(&trainer->shown, trainer->scene, trainer->trainee);
    return true;
}

// Writes the names of the devices that have sent reports, for the session file.
static void name_devices(Trainer *trainer, char out[SESSION_NAME])
{
    char all[2048] = "keyboard";
    size_t used = strlen(all);
    for (int i = 0; i < PADS; i++)
        if (atomic_load(&trainer->pad[i]->reports) > 0)
            used += (size_t)snprintf(all + used, sizeof all - used, ", gamepad");
    for (int i = 0; trainer->hands && i < HANDS_MOST; i++) {
        HandInfo info;
        hands_info(trainer->hands, i, &info);
        if (info.reports > 0)
            used += (size_t)snprintf(all + used, sizeof all - used, ", %.95s", info.name);
        trainer->figures->reports += info.reports;
    }
    snprintf(out, SESSION_NAME, "%.*s", SESSION_NAME - 1, all);
}

// What closes a session besides the window: this takes seconds on a slow disk, or after a long session.
typedef struct Closing {
    Trainer *trainer;
    Faults *faults;
    const char *device;
    RealtimeFigures real;
    bool is_whole;
    _Atomic bool is_done;
} Closing;

// Ends the thread of the simulation, closes the recording, and writes the session file into its folder.
static void *close_session(void *context)
{
    Closing *closing = context;
    Trainer *trainer = closing->trainer;
    const LiveSession *session = &trainer->session;
    bool whole = live_session_stop(&trainer->session, &closing->real, closing->faults);
    if (whole && session->record_path[0])
        whole = session_files_save(trainer->scene, trainer->trainee, closing->device, trainer->date, session_tracker_score(session->tracker),
                                   session->record_path, closing->faults);
    closing->is_whole = whole;
    atomic_store(&closing->is_done, true);
    return NULL;
}

// Closes the session in a thread while the window goes on. A short closing is not announced.
static void close_beside_window(Trainer *trainer, Closing *closing)
{
    const double announced_s = 0.15;
    const WindowInput *input;
    double begun = since_begin(trainer);
    pthread_t thread;
    if (pthread_create(&thread, NULL, close_session, closing) != 0) {
        close_session(closing);
        return;
    }
    while (!atomic_load(&closing->is_done)) {
        if (since_begin(trainer) - begun < announced_s || !window_next_frame(trainer->window, &input))
            nanosleep(&(struct timespec){.tv_nsec = 5000000}, NULL);
        else
            draw_panel_alone(trainer, input, "Saving the session");
    }
    pthread_join(thread, NULL);
}

static bool end_session(Trainer *trainer, Faults *faults)
{
    TrainerFigures *figures = trainer->figures;
    LiveSession *session = &trainer->session;
    char device[SESSION_NAME];
    name_devices(trainer, device);
    Closing closing = {.trainer = trainer, .faults = faults, .device = device};
    close_beside_window(trainer, &closing);
    memcpy(figures->step_us, closing.real.step_us, sizeof figures->step_us);
    memcpy(figures->late_us, closing.real.late_us, sizeof figures->late_us);
    figures->deadline_misses = closing.real.deadline_misses;
    figures->slowed_s = closing.real.slowed_s;
    figures->real_time_priority = closing.real.real_time_priority;
    snprintf(figures->hash, sizeof figures->hash, "%016llx", (unsigned long long)simulator_hash(session->simulator));
    snprintf(figures->recording, sizeof figures->recording, "%s", session->record_path);
    live_session_free(session);
    return closing.is_whole;
}

// --- hands ---

static void drive_by_keys(Trainer *trainer, const PanelActions *actions)
{
    const Command command[2] = {controls_command(&trainer->controls, actions), controls_partner_command(&trainer->controls, actions)};
    for (int i = 0; i < 2; i++) {
        atomic_store_explicit(&trainer->keyboard[i].push_mm_s, command[i].push_mm_s, memory_order_relaxed);
        atomic_store_explicit(&trainer->keyboard[i].twist_deg_s, command[i].twist_deg_s, memory_order_relaxed);
    }
    atomic_store_explicit(&trainer->keyboard[0].buttons, actions->held[ACTION_STOP] ? HAND_STOP : 0, memory_order_relaxed);
    realtime_set_grip(trainer->session.realtime, &trainer->controls.grip);
}

static const DeviceMap *map_for_pad(const Trainer *trainer, const WindowGamepad *pad)
{
    const DeviceMap *map[TRAINER_MAPS + 2];
    int count = 0;
    for (int i = 0; i < trainer->options->map_count; i++)
        map[count++] = trainer->options->map[i];
    for (int i = 0; i < 2; i++)
        if (trainer->built_in[i])
            map[count++] = trainer->built_in[i];
    return gamepad_choose_map(map, count, pad->is_mapped, pad->name);
}

static void drive_by_pads(Trainer *trainer)
{
    for (int i = 0; i < PADS; i++) {
        WindowGamepad pad;
        Gamepad *gamepad = &trainer->gamepad[i];
        bool is_there = window_gamepad(trainer->window, i, &pad), was_there = atomic_load(&trainer->pad[i]->state) == HAND_READY;
        int vendor, product;
        if (is_there && gamepad_ids_of_guid(pad.guid, &vendor, &product) && hands_drives(trainer->hands, vendor, product)) {
            if (was_there)
                gamepad_lost(gamepad, trainer->pad[i]);   // its HID reports are read directly: otherwise the device would count twice
            gamepad->map = NULL;
            continue;
        }
        if (!is_there) {
            if (was_there) {
                gamepad_lost(gamepad, trainer->pad[i]);
                show_message(trainer, MARK_WARNING, "%s unplugged: plug it in again to continue", window_gamepad_name(trainer->window, i));
            }
            gamepad->map = NULL;
            continue;
        }
        const DeviceMap *map = gamepad->map || trainer->pad_refused[i] ? NULL : map_for_pad(trainer, &pad);
        if (map) {
            static Faults faults;
            faults_clear(&faults);
            bool is_bound = gamepad_bind(gamepad, map, pad.axis_count, pad.button_count, pad.name, &faults);
            trainer->pad_refused[i] = !is_bound;
            show_message(trainer, is_bound ? MARK_GOOD : MARK_BAD, "%s: %s", pad.name, is_bound ? map->name : faults.text[0]);
        }
        if (gamepad->map)
            gamepad_update(gamepad, pad.axis, pad.axis_count, pad.button, pad.button_count, trainer->pad[i]);
    }
}

static unsigned buttons_of_hands(const Trainer *trainer)
{
    unsigned buttons = 0;
    for (int i = 0; i < PADS; i++)
        buttons |= atomic_load_explicit(&trainer->pad[i]->buttons, memory_order_relaxed);
    for (int i = 0; trainer->hands && i < HANDS_MOST; i++)
        buttons |= atomic_load_explicit(&hands_port(trainer->hands, i)->buttons, memory_order_relaxed);
    return buttons;
}

// --- actions ---

static void show_grip(Trainer *trainer, const HandGrip *before, const PanelActions *actions)
{
    const HandGrip *now = &trainer->controls.grip;
    const SceneTool *tool = trainer->scene->tool;
    int count = trainer->scene->tool_count;
    char first[16], last[16];
    for (int k = count; k < TOOLS_MOST; k++)
        if (actions->pressed[ACTION_TOOL_1 + k])
            show_message(trainer, MARK_NONE, "there is no tool %d, the scene has %d; the keys of the views are %s to %s", k + 1, count,
                         key_table_text(ACTION_VIEW_FLUOROSCOPY, first, sizeof first), key_table_text(ACTION_VIEW_ALL, last, sizeof last));
    if (now->chosen != before->chosen)
        show_message(trainer, MARK_NONE, "tool %d selected: %s", now->chosen + 1, tool[now->chosen].name);
    for (int k = 1; k < count; k++)
        if ((now->locked ^ before->locked) >> k & 1)
            show_message(trainer, MARK_NONE, now->locked >> k & 1 ? "%s and %s are locked: they move as one" : "%s and %s are unlocked", tool[k - 1].name,
                         tool[k].name);
    if (count < 2 && actions->pressed[ACTION_LOCK])
        show_message(trainer, MARK_NONE, "the scene has only one tool, so it cannot be locked to another");
    for (int k = 0; k < count; k++)
        if ((now->released ^ before->released) >> k & 1)
            show_message(trainer, MARK_NONE, now->released >> k & 1 ? "%s is released: only its valve holds it" : "%s is held again", tool[k].name);
}

static void show_position(Trainer *trainer, const PanelActions *actions)
{
    const OperatorControls *controls = &trainer->controls;
    char angles[32];
    c_arm_label(&controls->xray, angles);
    if (actions->pressed[ACTION_STORE])
        show_message(trainer, MARK_GOOD, "position %d of %d stored: %s", controls->recalled + 1, STORED_POSITIONS, angles);
    else if (actions->pressed[ACTION_RECALL] && controls->stored_count > 0)
        show_message(trainer, MARK_NONE, "position %d of %d: %s", controls->recalled + 1, controls->stored_count, angles);
    else if (actions->pressed[ACTION_RECALL])
        show_message(trainer, MARK_NONE, "no position of the C-arm is stored");
}

static void take_reference(Trainer *trainer, const PanelActions *actions)
{
    const Moment *moment = realtime_moment(trainer->session.realtime);
    if (actions->pressed[ACTION_REFERENCE] && trainer->controls.second == SECOND_REFERENCE && moment)
        views_take_reference(trainer->views, moment->pose);
}

// --- the tray ---

// scenes/tools relative to the program in its build folder, build/PRESET/seldinger.
static const char *library(const Trainer *trainer, char *text, size_t capacity)
{
    if (trainer->options->library)
        return trainer->options->library;
    ssize_t length = readlink("/proc/self/exe", text, capacity - 1);
    if (length <= 0)
        return NULL;
    text[length] = 0;
    char *slash = strrchr(text, '/');
    snprintf(slash, capacity - (size_t)(slash - text), "/../../scenes/tools");
    return text;
}

static void open_tray(Trainer *trainer, const Pose *pose)
{
    const int tool = trainer->controls.grip.chosen;
    char text[4200];
    int in;
    if (trainer->scene->tool_count < 2) {
        show_message(trainer, MARK_WARNING, "the scene has only one tool: a tool is exchanged over the one inside it or through the one around it");
        return;
    }
    // use the library only if the author of the scene has listed no devices
    const char *folder = trainer->own_devices[tool] > 1 ? NULL : library(trainer, text, sizeof text);
    trainer->has_tray = trainer_tray_open(&trainer->tray, trainer->scene, tool, folder, pose, &in);
    if (trainer->has_tray)
        panel_open_tray(trainer->panel, trainer->tray.devices.count, in);
    else
        show_message(trainer, MARK_BAD, "out of memory for the tray");
}

static void close_tray(Trainer *trainer)
{
    panel_close_tray(trainer->panel);
    trainer_tray_close(&trainer->tray);
    trainer->has_tray = trainer->is_tray_due = false;
}

// Continues the session with a scene that has one more device: everything is simulated and recorded again, as fast as possible. Returns true if the
// session continues, in the old scene if the new one was refused.
static bool go_on_in(Trainer *trainer, Scene *scene, bool has_begun, Faults *faults)
{
    char path[sizeof trainer->session.record_path];
    RealtimeFigures real;
    Scene *before = trainer->scene;
    const HandGrip grip = trainer->controls.grip;
    const bool has_reported_end = trainer->has_reported_end;
    snprintf(path, sizeof path, "%s", trainer->session.record_path);
    trainer->progress = "Simulating the session again with the new device";
    bool good = live_session_stop(&trainer->session, &real, faults);
    live_session_free(&trainer->session);
    RecordedRun *run = good && has_begun ? recorded_run_load_series(path, faults) : NULL;
    good = good && (run || !has_begun);
    trainer->scene = scene;
    bool is_taken = good && begin_session(trainer, run, faults);
    if (!is_taken) {
        trainer->scene = before;
        good = good && begin_session(trainer, run, faults);
    }
    recorded_run_free(run);
    trainer->has_reported_end = has_reported_end;
    trainer->controls.grip.locked = good ? grip.locked & ~(trainer->controls.grip.released | trainer->controls.grip.released << 1) : 0;
    if (good && path[0])
        remove(path);            // the new recording contains all of it
    return good;
}

static void show_new_scene(Trainer *trainer, Faults *faults)
{
    OperatorControls controls;
    char note[512];
    Views *views = scene_views_create(trainer->scene, trainer->open, &controls, note, sizeof note, faults);
    if (views) {
        views_destroy(trainer->views);
        trainer->views = views;
        views_set_budget(views, DRAWING_BUDGET_MS);
    }
}

// Adds a new device to the scene. Returns false if the session has ended.
static bool add_device(Trainer *trainer, bool has_begun, Faults *faults)
{
    TrainerTray *tray = &trainer->tray;
    const TipShaping tip = trainer_tray_tip(tray);
    Scene *scene = tray_scene_with(trainer->scene, tray->devices.tool, &tray->devices.device[tray->choice.device], &tip, faults);
    if (scene)
        scene->contact = trainer->scene->contact;    // that of a resumed recording may differ from the text of the scene
    bool good = scene && open_vessel_inlet(scene, trainer->open, faults), lives = !good || go_on_in(trainer, scene, has_begun, faults);
    bool is_taken = good && lives && trainer->scene == scene;
    if (is_taken)
        show_new_scene(trainer, faults);
    if (faults->count > 0)
        show_message(trainer, MARK_BAD, "%s", faults->text[0]);
    if (lives)
        faults_clear(faults);
    if (is_taken) {
        scene_free(trainer->own_scene);
        trainer->own_scene = scene;
    } else {
        scene_free(scene);
    }
    return lives;
}

static bool take_from_tray(Trainer *trainer, const Pose *pose, Faults *faults)
{
    TrainerTray *tray = &trainer->tray;
    int tool = tray->devices.tool, which = tray->devices.device[tray->choice.device].which;
    const char *obstacle = trainer_tray_obstacle(tray);
    bool has_begun = pose->step > 0, is_new = which < 0 || trainer_tray_tip(tray).length > 0, lives = true;
    if (!obstacle && is_new && has_begun && !trainer->session.record_path[0])
        obstacle = "this session is not recorded: it can only use the devices that it started with";
    if (obstacle) {
        show_message(trainer, MARK_WARNING, "%s", obstacle);
        trainer->is_tray_due = false;
        return true;
    }
    if (is_new && !trainer->is_tray_due) {
        show_message(trainer, MARK_NONE, "simulating the session (%.0f s) again with the new device", pose->time_s);
        return trainer->is_tray_due = true;
    }
    if (is_new) {
        const Scene *before = trainer->scene;
        lives = add_device(trainer, has_begun, faults);
        which = lives && trainer->scene != before ? scene_device_count(trainer->scene, tool) - 1 : -1;
    }
    if (lives && which >= 0)
        hand_grip_fit(&trainer->controls.grip, trainer->scene->tool_count, tool, which);
    close_tray(trainer);
    return lives;
}

// Device buttons control the tray while it is open. Returns false if the session has ended.
static bool obey_tray(Trainer *trainer, const PanelActions *actions, unsigned pressed, Faults *faults)
{
    const Moment *moment = realtime_moment(trainer->session.realtime);
    if (!moment)
        return true;
    if (!trainer->has_tray) {
        if ((actions->pressed[ACTION_EXCHANGE] & 1) || (pressed & HAND_EXCHANGE))
            open_tray(trainer, moment->pose);
        return true;
    }
    panel_move_in_tray(trainer->panel, ((pressed & HAND_CHOOSE_INNER) != 0) - ((pressed & HAND_CHOOSE_OUTER) != 0));
    if (!actions->tray.is_open && !actions->tray.is_taken && !trainer->is_tray_due) {
        close_tray(trainer);
        return true;
    }
    if (!trainer->is_tray_due)
        trainer_tray_show(&trainer->tray, trainer->scene, moment->pose, &actions->tray);
    if (pressed & HAND_RELEASE)
        close_tray(trainer);
    else if (actions->tray.is_taken || (pressed & HAND_EXCHANGE) || trainer->is_tray_due)
        return take_from_tray(trainer, moment->pose, faults);
    return true;
}

// Reports the outcome of an exchange and requests the inserted device from now on.
static void show_exchanges(Trainer *trainer, const Pose *pose)
{
    HandGrip *grip = &trainer->controls.grip;
    bool is_refused = pose->refused_exchanges > trainer->refused;
    for (int k = 0; k < pose->tool_count; k++) {
        const SceneTool *device = scene_device(trainer->scene, k, pose->tool[k].fitted);
        if (trainer->fitted[k] >= 0 && pose->tool[k].fitted != trainer->fitted[k])
            show_message(trainer, MARK_GOOD, "%s is now: %s", trainer->scene->tool[k].name,
                         device && device->title[0] ? device->title
                         : pose->tool[k].fitted     ? "the spare one"
                                                    : "the first one");
        if (trainer->fitted[k] >= 0 && is_refused && grip->fitted[k] != pose->tool[k].fitted) {
            show_message(trainer, MARK_WARNING, "%s was not exchanged: %s", trainer->scene->tool[k].name, step_exchange_refusal(pose->refusal));
            grip->fitted[k] = pose->tool[k].fitted;
        }
        trainer->fitted[k] = pose->tool[k].fitted;
    }
    trainer->refused = pose->refused_exchanges;
}

static void take_screenshot(Trainer *trainer, const WindowInput *input)
{
    char path[4096], message[256];
    uint8_t *rgb = malloc((size_t)input->width * (size_t)input->height * 3);
    session_file_name(trainer->options->folder, trainer->scene->path, ".png", path, sizeof path);
    if (rgb)
        gl_framebuffer_read(0, input->width, input->height, rgb);
    if (rgb && png_file_write(path, input->width, input->height, rgb, message, sizeof message))
        show_message(trainer, MARK_GOOD, "saved picture %s", path);
    else
        show_message(trainer, MARK_BAD, "no picture: %s", rgb ? message : "out of memory");
    free(rgb);
}

static void obey_cine(Trainer *trainer, const PanelActions *actions, Faults *faults)
{
    char remark[600], stem[4096];
    if (trainer_cine_obey(&trainer->cine, actions, remark, sizeof remark))
        fluoroscope_forget(views_fluoroscope(trainer->views));
    if (*remark)
        show_message(trainer, MARK_NONE, "%s", remark);
    if (!actions->pressed[ACTION_CINE_SAVE])
        return;
    session_file_name(trainer->options->folder, trainer->scene->path, "", stem, sizeof stem);
    bool good = trainer_cine_save(&trainer->cine, trainer->views, stem, remark, sizeof remark, faults);
    show_message(trainer, good ? MARK_GOOD : MARK_WARNING, "%s", remark);
    faults_clear(faults);
}

static bool restart(Trainer *trainer, Faults *faults)
{
    bool whole = end_session(trainer, faults);
    panel_forget_samples(trainer->panel);
    fluoroscope_forget(views_fluoroscope(trainer->views));
    show_message(trainer, whole ? MARK_GOOD : MARK_BAD, whole ? "new session; the last one is saved" : "new session; the last one could not be saved: %s",
                 faults->text[0]);
    faults_clear(faults);
    trainer->is_paused = false;
    trainer->controls.pedal_latched = false;
    trainer->controls.xray = trainer->xray_at_start;
    session_date(time(NULL), trainer->date);
    return begin_session(trainer, NULL, faults);
}

// Returns false if the program must end.
static bool obey(Trainer *trainer, const PanelActions *actions, const WindowInput *input, Faults *faults)
{
    if (actions->trainee_set) {
        snprintf(trainer->trainee, sizeof trainer->trainee, "%s", actions->trainee);
        show_message(trainer, MARK_NONE, "trainee: %s", trainer->trainee);
    }
    if (actions->pressed[ACTION_PAUSE] & 1) {
        trainer->is_paused = !trainer->is_paused;
        realtime_pause(trainer->session.realtime, trainer->is_paused);
        if (trainer->hands)
            hands_pause(trainer->hands, trainer->is_paused);
    }
    if (actions->pressed[ACTION_BOOKMARK]) {
        trainer->controls.xray.bookmark++;
        show_message(trainer, MARK_GOOD, "bookmark %.0f", (double)trainer->controls.xray.bookmark);
    }
    if (actions->pressed[ACTION_SAVE])
        show_message(trainer, trainer->session.record_path[0] ? MARK_GOOD : MARK_WARNING,
                     trainer->session.record_path[0] ? "recorded so far in %s" : "this session is not recorded%s", trainer->session.record_path);
    if (actions->pressed[ACTION_FULL_SCREEN] & 1)
        window_set_full_screen(trainer->window, !window_is_full_screen(trainer->window));
    if (actions->pressed[ACTION_SCREENSHOT])
        take_screenshot(trainer, input);
    obey_cine(trainer, actions, faults);
    if (actions->pressed[ACTION_RESTART] && !restart(trainer, faults))
        return false;
    return !actions->pressed[ACTION_QUIT] && input->close != WINDOW_ENDED;
}

// --- display ---

static void show_events(Trainer *trainer, const Moment *moment)
{
    char text[HAND_MESSAGE_LENGTH];
    const TrackerView *tracked = moment->extra;
    while (trainer->hands && hands_message(trainer->hands, text, sizeof text))
        show_message(trainer, MARK_WARNING, "%s", text);
    if (!trainer->has_reported_end && (tracked->score.state == SCORE_REACHED || tracked->score.state == SCORE_TIME_OUT)) {
        trainer->has_reported_end = true;
        show_message(trainer, tracked->score.state == SCORE_REACHED ? MARK_GOOD : MARK_BAD, "%s: %.0f points",
                     tracked->score.state == SCORE_REACHED ? "target reached and held" : "time is up", tracked->score.points);
    }
}

// Writes "wire, microcatheter: ", the tools that a device moves now.
static void name_moved(const Trainer *trainer, const HandPort *port, int hand_count, char *text, size_t capacity)
{
    size_t used = 0;
    for (int h = 0; h < hand_count && used < capacity; h++) {
        int tool = hand_grip_tool(&trainer->controls.grip, trainer->scene->tool_count, atomic_load(&port[h].drives));
        used += (size_t)snprintf(text + used, capacity - used, "%s%s", trainer->scene->tool[tool].name, h + 1 < hand_count ? ", " : ": ");
    }
}

static void show_devices(Trainer *trainer)
{
    TrainerPanel *shown = &trainer->shown;
    PanelState *state = &shown->state;
    state->device_count = 0;
    state->device = shown->device;
    for (int i = 0; trainer->hands && i < HANDS_MOST; i++) {
        HandInfo info;
        hands_info(trainer->hands, i, &info);
        if (info.state == HAND_ABSENT)
            continue;
        int at = state->device_count++;
        snprintf(shown->device_name[at], sizeof shown->device_name[at], "%s", info.name);
        char moves[TOOLS_MOST * (TOOL_NAME_SIZE + 2)] = "";
        if (trainer->scene->tool_count > 1)
            name_moved(trainer, hands_port(trainer->hands, i), info.hand_count, moves, sizeof moves);
        snprintf(shown->device_note[at], sizeof shown->device_note[at], tr("%s%s, %.0f reports/s; %s"), moves, info.map, info.report_hz, info.force);
        shown->device[at] = (PanelDevice){shown->device_name[at], info.state, shown->device_note[at]};
        if (info.state == HAND_LOST)
            state->warnings |= WARN_DEVICE_LOST;
    }
}

static void show_to_instructor(Trainer *trainer, const WindowInput *input, double time_s, const ScoreFigures *score)
{
    uint8_t *rgb = instructor_view_is_due(trainer->instructor) ? instructor_view_pixels(trainer->instructor, input->width, input->height) : NULL;
    if (!rgb)
        return;
    gl_framebuffer_read(0, input->width, input->height, rgb);
    instructor_view_show(trainer->instructor, &(InstructorFigures){trainer->trainee, time_s, trainer->is_paused, score, trainer->scene});
}

// Whether anything has changed that the window shows. Figures that change without a movement are shown twice a second.
static bool is_picture_due(Trainer *trainer, const WindowInput *input, const Moment *moment, XrayControl xray)
{
    const double refresh_s = 0.5;
    const OperatorControls *controls = &trainer->controls;
    const int64_t shown[] = {trainer->pulses.count,          controls->view, trainer->is_paused, trainer->has_tray, trainer->is_tray_due, controls->second,
                             panel_is_asking(trainer->panel)};
    const TrackerView *tracked = moment->extra;
    xray.seen = xray.looks = 0;
    uint64_t settings = redraw_hash(0, shown, sizeof shown);
    settings = redraw_hash(settings, &xray, sizeof xray);
    settings = redraw_hash(settings, &controls->look, sizeof controls->look);
    settings = redraw_hash(settings, &controls->grip, sizeof controls->grip);
    settings = redraw_hash(settings, &tracked->score.state, sizeof tracked->score.state);
    settings = redraw_hash(settings, &tracked->score.error_total, sizeof tracked->score.error_total);
    // a loop that plays changes by itself
    if (trainer->cine.is_shown || cine_is_recording(trainer->cine.cine))
        trainer->redraw.trail = 1;
    return redraw_is_due(&trainer->redraw, input, moment->pose, settings, since_begin(trainer), refresh_s);
}

static void draw(Trainer *trainer, const WindowInput *input, const PanelLayout *layout, const XrayControl *xray, double passed_s, const Moment *moment)
{
    const TrackerView *tracked = moment->extra;
    const Pose *pose = moment->pose;
    ViewsFrame frame = {.pose = pose,
                        .xray = xray,
                        .pulse = (uint32_t)trainer->pulses.count,
                        .look = &trainer->controls.look,
                        .scope_tool = trainer->controls.grip.chosen + 1,
                        .is_repeat = trainer->redraw.is_repeat};
    trainer_cine_frame(&trainer->cine, passed_s, tracked->concentration, &frame);
    const XrayControl plane = xray_second_plane(xray);
    frame.second = trainer->controls.second == SECOND_PLANE ? &plane : NULL;
    views_draw(trainer->views, &frame, layout, input->width, input->height, 0);
    trainer_panel_show(&trainer->shown, trainer->scene, pose, &tracked->score, &moment->figures, xray);
    PanelState *state = &trainer->shown.state;
    trainer_panel_views(&trainer->shown, &trainer->controls, trainer->views, xray);
    trainer_panel_grip(&trainer->shown, &trainer->controls.grip);
    trainer_panel_injection(&trainer->shown, trainer->scene, tracked->contrast_tool, tracked->flow_ml_s, xray);
    state->now_s = since_begin(trainer);
    state->is_recording_cine = cine_is_recording(trainer->cine.cine);
    state->cine_frames = cine_count(trainer->cine.cine);
    if (trainer->cine.is_shown) {
        state->mode = PANEL_CINE;
        state->cine_frame = trainer->cine.player.frame;
        state->xray = *frame.xray;
    }
    state->tray = trainer->has_tray ? &trainer->tray.shown : NULL;
    show_exchanges(trainer, pose);
    state->frame_ms = 1000 * histogram_quantile(&trainer->frame_cpu_ns, 0.5) * 1e-9;
    show_events(trainer, moment);
    show_devices(trainer);
    panel_draw(trainer->panel, input, state, 0);
    show_to_instructor(trainer, input, pose->time_s, &tracked->score);
}

static double resident_mb(void)
{
    long pages = 0, ignored = 0;
    FILE *file = fopen("/proc/self/statm", "r");
    int read = file ? fscanf(file, "%ld %ld", &ignored, &pages) : 0;
    if (file)
        fclose(file);
    return read == 2 ? (double)pages * (double)sysconf(_SC_PAGESIZE) / 1e6 : 0;
}

static double drawing_cpu_s(const Trainer *trainer) { return clock_s(CLOCK_PROCESS_CPUTIME_ID) - realtime_cpu_s(trainer->session.realtime); }

static void measure_frame(Trainer *trainer)
{
    double cpu = drawing_cpu_s(trainer);
    if (trainer->figures->frames > 0)
        views_spend(trainer->views, 1000 * (cpu - trainer->frame_cpu_s));
    if (trainer->figures->frames++ > 0) {
        histogram_add(&trainer->frame_cpu_ns, (int64_t)((cpu - trainer->frame_cpu_s) * 1e9));
    } else {
        trainer->figures->first_picture_s = since_begin(trainer);
        trainer->figures->first_picture_cpu_s = clock_s(CLOCK_PROCESS_CPUTIME_ID);
    }
    trainer->frame_cpu_s = cpu;
    if (trainer->figures->frames == 1 || (trainer->figures->frames % 30 == 0 && since_begin(trainer) < 60))
        trainer->figures->resident_mb[0] = resident_mb();
}

static PanelLayout layout_of(const Trainer *trainer, const WindowInput *input)
{
    const bool has_panels = panel_has_panels(trainer->panel);
    PanelLayout layout = trainer->controls.is_examination ? panel_layout_xray_alone(input->width, input->height, input->scale, has_panels)
                                                          : panel_layout(input->width, input->height, input->scale, trainer->controls.view, has_panels);
    if (trainer->controls.second != SECOND_NONE)
        panel_layout_add_second(&layout, input->height);
    return layout;
}

// The controls of the next steps, with what the window shows during them.
static void send_xray(Trainer *trainer, const PanelLayout *layout, XrayControl *xray)
{
    const Moment *moment = realtime_moment(trainer->session.realtime);
    controls_note_sight(&trainer->controls, layout, moment ? moment->pose : NULL, !trainer->cine.is_shown, &trainer->controls.xray, xray);
    trainer->controls.xray.seen = xray->seen;
    trainer->controls.xray.looks = xray->looks;
    realtime_set_xray(trainer->session.realtime, xray);
}

static void run_window(Trainer *trainer, Faults *faults)
{
    const WindowInput *input;
    PanelActions actions = {0};
    double last = since_begin(trainer), drawn = last;
    for (bool is_running = true; is_running;) {
        bool visible = window_next_frame(trainer->window, &input);
        double now = since_begin(trainer);
        panel_take_input(trainer->panel, input, &actions);
        if (controls_refuse_hidden(&trainer->controls, &actions))
            show_message(trainer, MARK_WARNING, "this is an examination: the 3D view and angioscopy are hidden, steer by the X-ray image");
        PanelLayout layout = layout_of(trainer, input);
        const HandGrip grip = trainer->controls.grip;
        controls_obey(&trainer->controls, views_scene(trainer->views), &actions, &layout, fmin(now - last, 0.1));
        unsigned buttons = buttons_of_hands(trainer);
        actions.pressed[ACTION_BOOKMARK] += (buttons & ~trainer->buttons & HAND_MARK) != 0;
        const unsigned pressed = buttons & ~trainer->buttons;
        if (trainer->has_tray)
            trainer->buttons = buttons;
        hand_grip_obey(&trainer->controls.grip, trainer->controls.tool_count, buttons, &trainer->buttons);
        show_grip(trainer, &grip, &actions);
        show_position(trainer, &actions);
        take_reference(trainer, &actions);
        last = now;
        drive_by_keys(trainer, &actions);
        drive_by_pads(trainer);
        XrayControl xray = controls_xray(&trainer->controls, &actions, buttons_of_hands(trainer));
        layout = layout_of(trainer, input);
        send_xray(trainer, &layout, &xray);
        is_running = obey(trainer, &actions, input, faults) && obey_tray(trainer, &actions, pressed, faults) &&
                     !(trainer->options->duration_s > 0 && now > trainer->options->duration_s);
        if (!is_running || !visible)
            continue;
        layout = layout_of(trainer, input);
        xray = controls_xray(&trainer->controls, &actions, buttons_of_hands(trainer));   // a new session has begun with others
        const Moment *moment = realtime_moment(trainer->session.realtime);
        if (moment)
            pulse_clock_advance(&trainer->pulses, moment->pose->time_s, &moment->pose->xray);
        if (!moment || !is_picture_due(trainer, input, moment, xray)) {
            answer(trainer);
            trainer->frame_cpu_s = drawing_cpu_s(trainer);
            continue;
        }
        draw(trainer, input, &layout, &xray, now - drawn, moment);
        drawn = now;
        swap(trainer);
        measure_frame(trainer);
    }
}

// --- start and end ---

static bool open_views(Trainer *trainer, Faults *faults)
{
    char note[512];
    trainer->views = scene_views_create(trainer->scene, trainer->open, &trainer->controls, note, sizeof note, faults);
    trainer->controls.is_examination = trainer->options->is_examination || (trainer->scene->exercise && trainer->scene->exercise->is_examination);
    trainer->controls.view = trainer->controls.is_examination ? VIEW_FLUOROSCOPY : trainer->options->view;
    trainer->controls.xray.seen = (float)(SEEN_KNOWN | (trainer->controls.is_examination ? SEEN_EXAMINATION : 0));     // until the first picture
    trainer->xray_at_start = trainer->controls.xray;
    if (*note)
        show_message(trainer, MARK_WARNING, "%s", note);
    if (trainer->views)
        views_set_budget(trainer->views, DRAWING_BUDGET_MS);
    return trainer->views != NULL;
}

static bool open_hands(Trainer *trainer, Faults *faults)
{
    const TrainerOptions *options = trainer->options;
    HandsOptions hands = hands_default_options();
    hands.map = (const DeviceMap *const *)options->map;
    hands.map_count = options->map_count;
    hands.use_built_in = options->has_built_in_maps;
    const OperatorSpeeds speeds = controls_speeds();
    hands.push = speeds.push;
    hands.twist = speeds.twist;
    trainer->hands = hands_open(&hands, faults);
    const ToolNames tools = scene_tool_names(trainer->scene);
    char text[HAND_MESSAGE_LENGTH];
    for (int k = 0; k < tools.count; k++)
        if (device_maps_share(hands.map, hands.map_count, &tools, k, text, sizeof text))
            show_message(trainer, MARK_WARNING, "%s", text);
    if (options->has_built_in_maps) {
        trainer->built_in[0] = device_map_built_in(trainer->scene->tool_count > 1 ? BUILT_IN_GAMEPAD_PAIR : BUILT_IN_GAMEPAD);
        trainer->built_in[1] = device_map_built_in(BUILT_IN_JOYSTICK);
        for (int i = 0; i < 2; i++)
            if (trainer->built_in[i])
                device_map_scale(trainer->built_in[i], speeds.push, speeds.twist);
    }
    return trainer->hands != NULL;
}

static bool open_window(Trainer *trainer, Faults *faults)
{
    char message[512] = "", title[300];
    const TrainerOptions *options = trainer->options;
    if (options->instructor_port && !(trainer->instructor = instructor_view_open(options->instructor_port, message, sizeof message))) {
        faults_add(faults, "--instructor-port", 0, 0, "%s", message);
        return false;
    }
    snprintf(title, sizeof title, "Seldinger: %.200s", trainer->scene->exercise ? trainer->scene->exercise->title : trainer->scene->path);
    trainer->window = window_create(title, options->width, options->height, 0, message, sizeof message);
    trainer->panel = trainer->window ? panel_create(message, sizeof message) : NULL;
    if (!trainer->panel) {
        faults_add(faults, trainer->scene->path, 0, 0, "no window: %s", message);
        return false;
    }
    if (options->is_full_screen)
        window_set_full_screen(trainer->window, true);
    return true;
}

static bool open_cine(Trainer *trainer, Faults *faults)
{
    Stepper *stepper = simulator_stepper(trainer->session.simulator);
    CineShape shape = {.tool_count = stepper_tool_count(stepper), .contrast_count = trainer->open->tree ? trainer->open->tree->node_count : 0};
    for (int k = 0; k < shape.tool_count; k++) {
        shape.tool_nodes[k] = scene_most_nodes(trainer->scene, k);
        shape.contrast_count += shape.tool_nodes[k];
    }
    if (trainer_cine_open(&trainer->cine, &shape, trainer->options->cine, faults))
        return true;
    end_session(trainer, faults);
    return false;
}

int trainer_run(Scene *scene, OpenVessel *open, const TrainerOptions *options, TrainerFigures *figures, Faults *faults)
{
    Trainer *trainer = calloc(1, sizeof *trainer);
    int code = EXIT_BAD_INPUT;
    if (!trainer) {
        faults_add(faults, scene->path, 0, 0, "out of memory for a session");
        return code;
    }
    *trainer = (Trainer){.options = options,
                         .scene = scene,
                         .open = open,
                         .figures = figures,
                         .keyboard = {[1] = {.drives = DRIVES_PARTNER}},
                         .begun_s = clock_s(CLOCK_MONOTONIC)};
    for (int k = 0; k < scene->tool_count; k++)
        trainer->own_devices[k] = scene_device_count(scene, k);
    snprintf(trainer->trainee, sizeof trainer->trainee, "%s", options->trainee);
    bool is_open = open_window(trainer, faults) && open_views(trainer, faults) && open_hands(trainer, faults);
    if (is_open && options->is_recorded) {
        trainer_panel_begin(&trainer->shown, trainer->scene, trainer->trainee);
        offer_recovery(trainer);
    }
    session_date(time(NULL), trainer->date);
    if (is_open && begin_session(trainer, options->resume, faults) && open_cine(trainer, faults)) {
        run_window(trainer, faults);
        double resident = resident_mb();   // before the memory of the session is released
        is_open = trainer->session.realtime != NULL;
        const Moment *moment = is_open ? realtime_moment(trainer->session.realtime) : NULL;
        bool diverged = moment && moment->figures.state == REALTIME_DIVERGED;
        code = is_open && end_session(trainer, faults) ? diverged ? EXIT_UNTRUSTED : EXIT_DONE : EXIT_UNTRUSTED;
        figures->resident_mb[1] = resident;
        figures->frames_skipped = window_frames_skipped(trainer->window);
        figures->frame_cpu_ms[0] = histogram_quantile(&trainer->frame_cpu_ns, 0.5) * 1e-6;
        figures->frame_cpu_ms[1] = histogram_quantile(&trainer->frame_cpu_ns, 0.99) * 1e-6;
        figures->frame_cpu_ms[2] = (double)trainer->frame_cpu_ns.largest * 1e-6;
    }
    if (trainer->hands)
        hands_close(trainer->hands);
    for (int i = 0; i < 2; i++)
        free(trainer->built_in[i]);
    if (trainer->window)
        views_destroy(trainer->views);
    trainer_cine_close(&trainer->cine);
    trainer_tray_close(&trainer->tray);
    redraw_free(&trainer->redraw);
    scene_free(trainer->own_scene);
    panel_destroy(trainer->panel);
    instructor_view_close(trainer->instructor);
    if (trainer->window)
        window_destroy(trainer->window);
    free(trainer);
    return code;
}
