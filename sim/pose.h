// A snapshot of a run for views, panel and files. Copied from the simulator by the thread that owns it, or from a recording; plain data afterwards.
// Lengths mm, forces N, torque N mm, time s.
#ifndef SELDINGER_SIM_POSE_H
#define SELDINGER_SIM_POSE_H

#include "sim/recording.h"

// One of the coaxial tools over its whole length, also behind the hub, in the sheath and inside other tools. With one tool these are the pose's own nodes.
typedef struct PoseTool {
    Command command;         // of the last step
    double inserted_mm;      // beyond the mouth
    double turned_deg;       // twist applied since the start
    double push_n, torque_n_mm;      // reaction felt by the operator
    bool is_released;        // released
    int fitted;              // which of its devices is inserted: 0 the scene's, 1, 2, … those under its `exchange:`
    int node_capacity;       // at most, does not change during a run
    int node_count;          // of the inserted device
    ToolNode *node;          // (node_count)
} PoseTool;

typedef struct Pose {
    int64_t step;            // steps so far
    double time_s;
    Command command;         // of the last step, the first tool's
    XrayControl xray;
    double inserted_mm, turned_deg;  // fed in beyond the mouth; turned since the start
    StepReport report;       // of the last step
    int tool_count;          // outermost first
    PoseTool tool[STEP_TOOLS_MAX];
    int64_t refused_exchanges;       // exchanges refused so far …
    StepExchange refusal;            // … and the reason of the last refusal; EXCHANGE_DONE: none
    // the shared centreline, which the wall touches
    int node_capacity;       // at most M
    int node_count;          // M, proximal to distal; with several tools nodes come and go
    int first_free_node;     // nodes below it lie in the sheath
    Vec3 *position;          // (M)
    Quat *quaternion;        // (M) its x axis is the tool's tangent towards the tip
    NodeReport *node;        // (M) radius, wall force, gap, vessel node
} Pose;

// For at most `tool_nodes[k]` nodes of each tool, which is also the initial number. NULL if out of memory.
Pose *pose_create(int node_capacity, int tool_count, const int *tool_nodes);
Pose *pose_create_for(Simulator *simulator);
void pose_free(Pose *pose);
void pose_copy(Pose *to, const Pose *from);   // made for the same tools
// Detects from scratch (about 20 us): every 10 ms, not every step. Does not affect later steps. Allocates nothing.
void pose_take(Pose *pose, Simulator *simulator, const ToolCommands *commands, const XrayControl *xray);
// Copies the only tool's nodes from the shared centreline, with which they coincide.
void pose_fill_single_tool(Pose *pose);
// Where a tool's tip lies on the shared centreline: a node's index and the fraction of the distance to the next.
double pose_tool_end(const Pose *pose, int tool);
// [mm] from the proximal end of `tool`: where it passes the tip of `other`; its own length if `other` reaches further.
double pose_tool_passes(const Pose *pose, int tool, int other);
int pose_most_distal(const Pose *pose);      // the tool that reaches furthest
Pose *pose_create_for_run(const RecordedRun *run);
// Frame `frame` of a recording of `scene`; values not recorded (contacts, iterations, refusals) are 0.
void pose_from_run(Pose *pose, const Scene *scene, const RecordedRun *run, int64_t frame);
// Sets time, commands, X-ray controls and forces of another step; nodes stay.
void pose_figures_from_run(Pose *pose, const RecordedRun *run, int64_t step);

#endif
