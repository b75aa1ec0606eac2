// The simulator: advances a scene by commands and returns the poses of the tools, the forces and the score.
// A step allocates nothing, takes no lock and opens no file. The same commands give the same bits on every machine and with any number of threads, as long as
// the host leaves the floating-point environment at its default (round to nearest, denormals kept).
#ifndef SELDINGER_PUBLIC_SIMULATOR_H
#define SELDINGER_PUBLIC_SIMULATOR_H

#include "scene.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct SelSimulator SelSimulator;

typedef struct SelSimulatorOptions {
    size_t size;
    int keeps_score;             // 1 (default): figures for sel_simulator_score(); 0: none, which saves about 1 us a step
} SelSimulatorOptions;
SEL_API void sel_simulator_options_init(SelSimulatorOptions *options, size_t size);
static inline SelSimulatorOptions sel_simulator_defaults(void)
{
    SelSimulatorOptions options;
    sel_simulator_options_init(&options, sizeof options);
    return options;
}

// Starts at time 0 of the scene. `options` may be NULL. Errors: SEL_ERROR_ARGUMENT, SEL_ERROR_INPUT (the scene cannot be simulated), SEL_ERROR_MEMORY.
SEL_API SelStatus sel_simulator_create(SelContext *context, const SelScene *scene, const SelSimulatorOptions *options, SelSimulator **simulator);
// The context that keeps its faults; the one of sel_simulator_create(), or of the batch that made it. Lives as long as the simulator.
SEL_API SelContext *sel_simulator_context(SelSimulator *simulator);
// Ends a recording that is still running; its errors are then lost (use sel_simulator_end_recording()).
SEL_API void sel_simulator_destroy(SelSimulator *simulator);

// Makes one step of sel_scene_step_s(). `hand` NULL: every tool is held still. A step with a failed or unreliable numerical solution still succeeds: see
// `flags`. Errors: SEL_ERROR_ARGUMENT (a command is not finite or out of range; no step was taken), SEL_ERROR_OUTPUT (the recording cannot be written; the step
// was taken).
SEL_API SelStatus sel_simulator_step(SelSimulator *simulator, const SelHand *hand);
// Makes `count` steps with one command, as if sel_simulator_step() were called that often; stops at the first error.
SEL_API SelStatus sel_simulator_repeat(SelSimulator *simulator, const SelHand *hand, int count);
// Makes `count` steps with the commands of the scene's script.
SEL_API SelStatus sel_simulator_follow(SelSimulator *simulator, int count);
// Returns to time 0 of the scene, as if the simulator were created again. Allocates for a score only. Errors: SEL_ERROR_STATE (a recording runs; nothing was
// done), SEL_ERROR_MEMORY (the simulator is at time 0, without a score).
SEL_API SelStatus sel_simulator_reset(SelSimulator *simulator);
// Makes a simulator a copy of another one of the same scene: the next steps of both are the same bit for bit. Neither may keep a score. Allocates. Errors:
// SEL_ERROR_ARGUMENT (another scene), SEL_ERROR_STATE (a score is kept or a recording runs), SEL_ERROR_MEMORY.
SEL_API SelStatus sel_simulator_copy(SelSimulator *simulator, const SelSimulator *from);
// The command of the scene's script for the next step; zero if there is no script or it has ended.
SEL_API SelStatus sel_simulator_script_hand(SelSimulator *simulator, SelHand *hand);

// --- reading; none of these functions affects later steps ---

// Bits of `flags` in a report.
enum {
    SEL_STEP_DIVERGED = 1,           // the solution diverged and the previous state was kept; the run cannot be trusted
    SEL_STEP_NOT_CONVERGED = 2,      // the contact solution stopped at its limit of iterations
    SEL_STEP_DEEP = 4,               // a node is more than 0.2 mm outside the wall
    SEL_STEP_FULLY_INSERTED = 8,     // the whole tool is in: the rest of the advance was refused
    SEL_STEP_FULLY_WITHDRAWN = 16,   // the same for retraction
    SEL_STEP_OUT_OF_VESSEL = 32,     // a node is beyond an open end that is not the sheath's
    SEL_STEP_DETECTION_UNSURE = 64,  // a projection to the wall did not converge
    SEL_STEP_LIMITED = 128,          // the motion was cut short; later steps complete it
    SEL_STEP_MODEL_DISAGREES = 256,  // two parts of the vessel's model put the wall at different places
    SEL_STEP_HAND_SLIPS = 512        // the tool's resistance exceeded the force that the hand holds
};

typedef struct SelReport {
    size_t size;                     // set by sel_simulator_report()
    unsigned flags;                  // SEL_STEP_ of the last step …
    unsigned flags_ever;             // … and of all steps so far
    int contacts;                    // number of contacts with force
    int self_contacts;               // places where a tool presses on itself
    int iterations;                  // iterations of the contact solution
    double residual;                 // residual of the contact forces
    double penetration_mm;           // deepest, >= 0
    double wall_force_max_n;         // largest contact force
    double wall_force_sum_n;         // sum of the magnitudes
    double push_n[SEL_TOOLS_MOST];       // force at each hand, > 0 when it pushes against resistance
    double torque_n_mm[SEL_TOOLS_MOST];  // torque at each hand
    double inserted_mm[SEL_TOOLS_MOST];  // length beyond the sheath
    double turned_deg[SEL_TOOLS_MOST];   // by each hand since the start
    double step_us;                  // CPU time of the last step
    double push_least_n, push_most_n;    // of the first tool, over all steps
} SelReport;

SEL_API int64_t sel_simulator_steps(const SelSimulator *simulator);      // so far
SEL_API double sel_simulator_time_s(const SelSimulator *simulator);
// Hash of the state, bit for bit: equal hashes are equal runs. It is the `state_hash` of `seldinger run --summary`.
SEL_API uint64_t sel_simulator_hash(const SelSimulator *simulator);
// Reports the last step; forces are 0 before the first. `size`: sizeof(SelReport). Error: SEL_ERROR_ARGUMENT.
SEL_API SelStatus sel_simulator_report(const SelSimulator *simulator, SelReport *report, size_t size);

// A node of a tool, proximal to distal.
typedef struct SelNode {
    double s_mm;                     // arc length from the proximal end
    double position_mm[3];
    double quaternion[4];            // w, x, y, z: the tool's own frame in space
    double radius_mm;
    int carrier;                     // the outermost tool at this place, 0 the first; -1: in the sheath or behind the hub
} SelNode;
// Capacity needed for the nodes of a tool with any of its devices; 0: no such tool.
SEL_API int sel_simulator_node_capacity(const SelSimulator *simulator, int tool);
// Writes up to `capacity` nodes of a tool and their number. Errors: SEL_ERROR_ARGUMENT (no such tool, or too little room).
SEL_API SelStatus sel_simulator_nodes(SelSimulator *simulator, int tool, SelNode *node, int capacity, int *count);
// The centreline that all tools share, from the sheath to the foremost tip, without a copy: (count, 3) positions [mm] and (count, 4) quaternions w, x, y, z
// whose x axis points along it. The arrays live as long as the simulator and change in each step and reset; `count` is constant with one tool. Any pointer may
// be NULL. Error: SEL_ERROR_ARGUMENT.
SEL_API SelStatus sel_simulator_centreline(const SelSimulator *simulator, const double **position_mm, const double **quaternion, int *count);
// The position of a tool's tip.
SEL_API SelStatus sel_simulator_tip(SelSimulator *simulator, int tool, double position_mm[3]);

// A place where the wall presses on the tools; with several tools, on the outermost one at that place.
typedef struct SelContact {
    int node;                        // of the centreline that all tools share, from the sheath to the foremost tip
    double s_mm;                     // along that centreline
    double position_mm[3];
    double force_n[3];               // from the wall on the tool
    double gap_mm;                   // negative in penetration
} SelContact;
// Writes up to `capacity` contacts and the number available, which may be larger. Queries the vessel again, about 20 us: for displays, not for each step.
SEL_API SelStatus sel_simulator_contacts(SelSimulator *simulator, SelContact *contact, int capacity, int *count);

// How close the foremost tip came to a target of the scene.
typedef struct SelTargetReach {
    double distance_mm;              // least so far
    double time_s;                   // time of that distance, or the time when the target was first reached
    int is_reached;
} SelTargetReach;
SEL_API int sel_simulator_target_count(const SelSimulator *simulator);
SEL_API SelStatus sel_simulator_target(const SelSimulator *simulator, int target, SelTargetReach *reach);

// --- score ---

typedef enum SelScoreState { SEL_SCORE_WAITING = 0, SEL_SCORE_RUNNING = 1, SEL_SCORE_REACHED = 2, SEL_SCORE_TIME_OUT = 3 } SelScoreState;

typedef struct SelScore {
    size_t size;                     // set by sel_simulator_score()
    SelScoreState state;
    double points;                   // 0 to 100; 0 if the scene has no exercise
    double time_s;                   // since the first movement
    double path_mm;                  // of the tip
    double way_mm;                   // length of the path from the tip's start to the target along the vessel; 0 without an exercise
    double remaining_mm;             // remaining length of that path
    double inserted_mm, withdrawn_mm;    // of all tools in sum, both >= 0
    double wall_force_peak_n;
    double wall_impulse_n_s;         // sum of all contact forces over time
    double tip_force_peak_n;         // means over 20 ms
    double contrast_ml;
    int errors;                      // handling errors
} SelScore;
// `size`: sizeof(SelScore). Errors: SEL_ERROR_ARGUMENT, SEL_ERROR_STATE (the simulator keeps no score).
SEL_API SelStatus sel_simulator_score(const SelSimulator *simulator, SelScore *score, size_t size);
// All figures, as `seldinger run --score` writes them: JSON, to be freed by sel_free().
SEL_API SelStatus sel_simulator_score_json(const SelSimulator *simulator, char **json);

// --- pictures ---

// A plain X-ray picture of vessels and tools: transmission without anatomy and noise. The C-arm's geometry is the trainer's.
typedef struct SelImageOptions {
    size_t size;
    double lao_deg;                  // C-arm: LAO > 0, RAO < 0; -90 to 90
    double cra_deg;                  // cranial > 0, caudal < 0; -45 to 45
    double field_mm;                 // side of the square seen at the isocentre, 40 to 400; 0 (default): all vessels are seen
    int has_centre;                  // 1: the isocentre is centre_mm; 0 (default): the middle of the vessels
    double centre_mm[3];
    double contrast;                 // contrast agent in all vessels, 0 to 1 (undiluted); default 0.3
    int pixels;                      // side of the picture, 8 to 4096; default 256
} SelImageOptions;
SEL_API void sel_image_options_init(SelImageOptions *options, size_t size);
static inline SelImageOptions sel_image_defaults(void)
{
    SelImageOptions options;
    sel_image_options_init(&options, sizeof options);
    return options;
}
// Writes `pixel`, (pixels, pixels), the top row first: 255 exp(-attenuation), 255 where nothing attenuates. The vessels of a scene with a tree, or with a tube,
// are shown; they are kept until another view is wanted. `options` may be NULL. Errors: SEL_ERROR_ARGUMENT, SEL_ERROR_MEMORY.
SEL_API SelStatus sel_simulator_image(SelSimulator *simulator, const SelImageOptions *options, unsigned char *pixel);

// --- recording ---

typedef struct SelRecordingOptions {
    size_t size;
    double frame_ms;                 // simulated time between frames with all nodes; default 10
    double expected_s;               // simulated time that will be recorded; 0 (default): unknown
} SelRecordingOptions;
SEL_API void sel_recording_options_init(SelRecordingOptions *options, size_t size);
static inline SelRecordingOptions sel_recording_defaults(void)
{
    SelRecordingOptions options;
    sel_recording_options_init(&options, sizeof options);
    return options;
}

// Records all steps from now on to an HDF5 file that any HDF5 reader can open while it is written; a separate thread writes it. `options` may be NULL.
// Errors: SEL_ERROR_STATE (after the first step, or a recording runs), SEL_ERROR_OUTPUT, SEL_ERROR_MEMORY.
SEL_API SelStatus sel_simulator_record(SelSimulator *simulator, const char *path, const SelRecordingOptions *options);
// Writes the remaining data and closes the file. Errors: SEL_ERROR_STATE (nothing is recorded), SEL_ERROR_OUTPUT.
SEL_API SelStatus sel_simulator_end_recording(SelSimulator *simulator);

#ifdef __cplusplus
}
#endif

#endif
