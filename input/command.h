// The operator's commands for the tools in one step.
#ifndef SELDINGER_INPUT_COMMAND_H
#define SELDINGER_INPUT_COMMAND_H

typedef struct Command {
    double push_mm_s;        // > 0 into the patient
    double twist_deg_s;      // right-handed about the direction of advance
} Command;

enum { TOOLS_MOST = 4, EXCHANGES_MOST = 4, TOOL_NAME_SIZE = 32 };

typedef struct ToolCommands {
    Command tool[TOOLS_MOST];    // outermost first; tools without a command are pinned: 0
    unsigned released;           // bit k: tool k is released, so only the friction of its valve holds it
    int fitted[TOOLS_MOST];      // device fitted to tool k: 0 the scene's tool, 1, 2, … those under its `exchange:`
    double contrast_ml_s;        // contrast agent injected by a script …
    int contrast_tool;           // … through this tool, 1 the outermost; 0: none
} ToolCommands;

#endif
