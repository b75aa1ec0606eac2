// Shared by the parts of the scene reader (scene.c, scene_tools.c); internal.
#ifndef SELDINGER_SIM_SCENE_READING_H
#define SELDINGER_SIM_SCENE_READING_H

#include "base/base.h"
#include "sim/scene.h"

typedef struct ToolReading { // how a tool was read, for the rules that relate tools
    YamlValue whole, inserted;   // its YAML value; its `inserted_mm`, node 0 if it has none
    double inserted_mm;      // `inserted_known`: it was given and in range
    bool inserted_known;
    double length;           // [mm] of all sections …
    bool length_known;       // … unknown if one of them, or `length_mm`, had a fault
    bool sound;              // its sections and rest shape had no fault
} ToolReading;

typedef struct Reading {
    Scene *scene;
    YamlReader *reader;
    const char *path;
    Faults *faults;
    double total_length;     // of the first tool; 0 until known
    ToolReading tool[TOOLS_MOST], exchange[TOOLS_MOST * EXCHANGES_MOST];
} Reading;

static const NumberRange length_range = {0, 1e5, true}, friction_range = {0, 10, false};

static const double per_gpa = 1000;            // MPa
static const double per_g_cm3 = 1e-3;          // g/mm3
static const double per_second = 1000;         // ms
static const double per_deg = PI / 180;        // rad

enum { MOST_SECTIONS = 1000, MOST_PIECES = 10000, MOST_ELEMENTS = 10000 };

void *scene_zeroed(Reading *reading, int count, size_t size);    // NULL with a fault
char *scene_resolved(Reading *reading, const char *name);        // relative to the scene's file; NULL with a fault
bool scene_read_piece(YamlValue value, TubePiece *piece);        // a line or an arc, of a tube's path or a rest shape

// `anatomy:`, after `fluoroscopy:`: sets the patient's axes, too, if the landmarks give them.
void scene_read_anatomy(Reading *reading, YamlValue value);

// `wire:` becomes the scene's only tool, `tools:` up to four; scene->wire is that of the first. To be called before `sheath:` and `rig:` are read …
void scene_read_wire(Reading *reading, YamlValue value);
void scene_read_tools(Reading *reading, YamlValue value);
// … and this after them: sets what a tool inherits from the scene's start and how far each is inserted, and checks whether each fits into the one around it.
// `placed`: a sheath or a rig was given.
void scene_settle_tools(Reading *reading, bool placed);

#endif
