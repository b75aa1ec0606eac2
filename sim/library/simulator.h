// The handle of a simulator.
#ifndef SELDINGER_SIM_LIBRARY_SIMULATOR_H
#define SELDINGER_SIM_LIBRARY_SIMULATOR_H

#include "sim/library/context.h"
#include "sim/session_tracker.h"

// The vessels of the last picture.
typedef struct ImageMemory {
    SelImageOptions options; // for which they were drawn
    XrayControl xray;        // the view that these gave
    float *vessels;          // (pixels, pixels) attenuation by them; NULL: no picture yet
    float *tools;            // (pixels, pixels) scratch
    unsigned char *bare;     // (pixels, pixels) the picture without tools
} ImageMemory;
void image_memory_free(ImageMemory *memory);

struct SelSimulator {
    SelContext *context;
    const SelScene *scene;
    Simulator *simulator;
    SessionTracker *tracker; // NULL: no score
    Recording *recording;    // NULL: none
    bool has_lost_rows;      // the recording's file cannot be written
    int script_cursor;
    int node_capacity;       // of the shared centreline
    NodeReport *node;        // (node_capacity) scratch
    int own_capacity;        // for the tool with the most nodes
    ToolNode *own;           // (own_capacity) scratch
    ImageMemory image;
};

#endif
