// A moment of a run, as everything that looks at one sees it: views, panel, files. Copied out of the simulator by the thread that owns it, or
// out of a recording; after that it is plain data. Lengths mm, forces N, torque N mm, time s.
#ifndef SELDINGER_SIM_POSE_H
#define SELDINGER_SIM_POSE_H

#include "sim/recording.h"

// One of the coaxial tools, all of it: behind the hub, in the sheath and inside other tools too. With one tool these are the pose's own nodes.
typedef struct PoseTool {
    Command command;         // of the last step
    double inserted_mm;      // beyond the mouth
    double turned_deg;       // by its hand, since the start
    double push_n, torque_n_mm;      // that its hand feels
    bool is_let_go;          // no hand holds it
    int fitted;              // which of its devices is in: 0 the scene's, 1, 2, … those under its `exchange:`
    int node_capacity;       // at most, does not change during a run
    int node_count;          // of the device that is in
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
    int64_t refused_exchanges;       // so far …
    StepExchange refusal;            // … and why the last one was; EXCHANGE_DONE: none
    // the shared centreline, which the wall touches
    int node_capacity;       // M at most
    int node_count;          // M, proximal to distal; with several tools nodes come and go
    int first_free_node;     // nodes below it lie in the sheath
    Vec3 *position;          // (M)
    Quat *quaternion;        // (M) its x axis is the tool's tangent towards the tip
    NodeReport *node;        // (M) radius, wall force, gap, vessel node
} Pose;

Pose *pose_create(int node_count);   // for one tool with so many nodes; NULL where memory lacks
// For at most `tool_nodes[k]` nodes of each tool, so many at first.
Pose *pose_create_tools(int node_capacity, int tool_count, const int *tool_nodes);
Pose *pose_create_for(Simulator *simulator);
void pose_free(Pose *pose);
void pose_copy(Pose *to, const Pose *from);   // made for the same tools
// Detects afresh (about 20 us): every 10 ms, not every step. Changes nothing that a later step depends on. Allocates nothing.
void pose_take(Pose *pose, Simulator *simulator, const ToolCommands *commands, const XrayControl *xray);
// Its one tool's nodes from the shared centreline, which it is.
void pose_fill_single_tool(Pose *pose);
// Where a tool's tip lies on the shared centreline: a node's index and the part of the way to the next.
double pose_tool_end(const Pose *pose, int tool);
// [mm] from the proximal end of `tool`: where it passes the tip of `other`; its own length where `other` goes further.
double pose_tool_passes(const Pose *pose, int tool, int other);
int pose_most_distal(const Pose *pose);      // the tool that reaches furthest
Pose *pose_create_for_run(const RecordedRun *run);
// Frame `frame` of a recording of `scene`; what it does not hold (contacts, iterations, refusals) is 0.
void pose_from_run(Pose *pose, const Scene *scene, const RecordedRun *run, int64_t frame);
// Time, commands, X-ray controls and forces of another step; nodes stay.
void pose_figures_from_run(Pose *pose, const RecordedRun *run, int64_t step);

#endif
