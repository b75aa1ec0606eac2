// What an operator asks of the tools in one step.
#ifndef SELDINGER_INPUT_COMMAND_H
#define SELDINGER_INPUT_COMMAND_H

typedef struct Command {
    double push_mm_s;        // > 0 into the patient
    double twist_deg_s;      // right-handed about the direction of advance
} Command;

enum { TOOLS_MOST = 4, EXCHANGES_MOST = 4, TOOL_NAME_SIZE = 32 };

typedef struct ToolCommands {
    Command tool[TOOLS_MOST];    // outermost first; a tool that is not named is pinned: 0
    unsigned released;           // bit k: tool k is released and held only by the friction of its valve
    int fitted[TOOLS_MOST];      // device of tool k: 0 the scene's, 1, 2, … those under its `exchange:`
    double contrast_ml_s;        // that a script injects …
    int contrast_tool;           // … through this tool, 1 the outermost; 0: none
} ToolCommands;

#endif
