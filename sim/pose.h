// A moment of a run, as everything that looks at one sees it: views, panel, files. Copied out of the simulator by the thread that owns it, or
// out of a recording; after that it is plain data. Lengths mm, forces N, torque N mm, time s.
#ifndef SELDINGER_SIM_POSE_H
#define SELDINGER_SIM_POSE_H

#include "sim/recording.h"

typedef struct Pose {
    int64_t step;            // steps so far
    double time_s;
    Command command;         // of the last step
    XrayControl xray;
    double inserted_mm, turned_deg;  // fed in beyond the mouth; turned since the start
    StepReport report;       // of the last step
    int node_count;          // M, proximal to distal
    int first_free_node;     // nodes below it lie in the sheath
    Vec3 *position;          // (M)
    Quat *quaternion;        // (M) its x axis is the tool's tangent towards the tip
    NodeReport *node;        // (M) radius, wall force, gap, vessel node
} Pose;

Pose *pose_create(int node_count);   // NULL where memory lacks
void pose_free(Pose *pose);
void pose_copy(Pose *to, const Pose *from);   // same node_count
// Detects afresh (about 20 us): every 10 ms, not every step. Changes nothing that a later step depends on. Allocates nothing.
void pose_take(Pose *pose, Simulator *simulator, Command command, const XrayControl *xray);
// Frame `frame` of a recording of `scene` with as many nodes; what it does not hold (contacts, iterations) is 0.
void pose_from_run(Pose *pose, const Scene *scene, const RecordedRun *run, int64_t frame);

#endif
