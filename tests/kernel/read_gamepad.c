// Reads the first gamepad as the trainer does (GLFW's layout, our built-in map), without the trainer's images, which take an emulated processor a minute to
// draw. Prints `ready NAME`, then a line whenever it changes: `push MM_S twist DEG_S buttons BITS state STATE`. usage: read_gamepad SECONDS. Needs a display,
// as GLFW does.
#define GLFW_INCLUDE_NONE
#include "input/gamepad.h"

#include <GLFW/glfw3.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void print_port(const HandPort *port, char last[128])
{
    char line[128];
    // + 0.0: no -0
    snprintf(line, sizeof line, "push %.3f twist %.3f buttons %u state %d", atomic_load(&port->push_mm_s) + 0.0, atomic_load(&port->twist_deg_s) + 0.0,
             atomic_load(&port->buttons), atomic_load(&port->state));
    if (strcmp(line, last) == 0)
        return;
    printf("%s\n", strcpy(last, line));
    fflush(stdout);
}

static void follow(const DeviceMap *map, double seconds)
{
    static HandPort port;
    static Faults faults;
    Gamepad gamepad = {0};
    char last[128] = "";
    for (GLFWgamepadstate state; glfwGetTime() < seconds; glfwWaitEventsTimeout(0.05)) {
        if (glfwGetGamepadState(GLFW_JOYSTICK_1, &state)) {
            if (!gamepad.map && !gamepad_bind(&gamepad, map, GLFW_GAMEPAD_AXIS_LAST + 1, GLFW_GAMEPAD_BUTTON_LAST + 1, "gamepad", &faults)) {
                printf("refused: %s\n", faults.text[0]);
                return;
            }
            if (!last[0])
                printf("ready %s\n", glfwGetGamepadName(GLFW_JOYSTICK_1));
            gamepad_update(&gamepad, state.axes, GLFW_GAMEPAD_AXIS_LAST + 1, state.buttons, GLFW_GAMEPAD_BUTTON_LAST + 1, &port);
        } else if (gamepad.map)
            gamepad_lost(&gamepad, &port);
        if (gamepad.map)
            print_port(&port, last);
    }
}

int main(int argc, char **argv)
{
    DeviceMap *map = device_map_built_in(BUILT_IN_GAMEPAD);
    if (argc != 2 || !map || !glfwInit()) {
        fprintf(stderr, "usage: read_gamepad SECONDS; needs a display\n");
        free(map);
        return 2;
    }
    follow(map, atof(argv[1]));
    glfwTerminate();
    free(map);
    return 0;
}
