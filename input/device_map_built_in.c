// The built-in device maps. Forward (away from the user) pushes; right turns clockwise as seen from behind.
#include "input/device_map.h"

#include <string.h>

#define STICK_BUTTONS                                                                                                                                          \
    "pedal: {source: button_1, optional: true}\n"                                                                                                              \
    "contrast: {source: button_2, optional: true}\n"                                                                                                           \
    "stop: {source: button_3, optional: true}\n"                                                                                                               \
    "mark: {source: button_4, optional: true}\n"

#define PAD_BUTTONS                                                                                                                                            \
    "pedal: [{source: right_trigger, above: 0}, {source: a}]\n"                                                                                                \
    "contrast: {source: x}\n"                                                                                                                                  \
    "stop: {source: b}\n"                                                                                                                                      \
    "mark: {source: y}\n"

static const char *const texts[BUILT_IN_COUNT] = {
    [BUILT_IN_GAMEPAD] = "seldinger_device: 1\n"
                         "name: gamepad\n"
                         "device: {gamepad: true}\n"
                         "push:\n"
                         "  - {source: left_y, mm_s: 40, dead_zone: 0.15, exponent: 2, invert: true}\n"
                         "  - {source: dpad_up, mm_s: 2}\n"
                         "  - {source: dpad_down, mm_s: 2, invert: true}\n"
                         "twist:\n"
                         "  - {source: right_x, deg_s: 240, dead_zone: 0.15, exponent: 2}\n"
                         "  - {source: dpad_right, deg_s: 20}\n"
                         "  - {source: dpad_left, deg_s: 20, invert: true}\n" PAD_BUTTONS,
    [BUILT_IN_GAMEPAD_PAIR] = "seldinger_device: 1\n"
                              "name: gamepad, a tool in each stick\n"
                              "device: {gamepad: true}\n"
                              "push:\n"
                              "  - {source: left_y, mm_s: 40, dead_zone: 0.15, exponent: 2, invert: true, tool: outer}\n"
                              "  - {source: right_y, mm_s: 40, dead_zone: 0.15, exponent: 2, invert: true, tool: inner}\n"
                              "  - {source: dpad_up, mm_s: 2}\n"
                              "  - {source: dpad_down, mm_s: 2, invert: true}\n"
                              "twist:\n"
                              "  - {source: left_x, deg_s: 240, dead_zone: 0.15, exponent: 2, tool: outer}\n"
                              "  - {source: right_x, deg_s: 240, dead_zone: 0.15, exponent: 2, tool: inner}\n"
                              "  - {source: dpad_right, deg_s: 20}\n"
                              "  - {source: dpad_left, deg_s: 20, invert: true}\n"
                              "choose_outer: {source: left_bumper}\n"
                              "choose_inner: {source: right_bumper}\n"
                              "lock: {source: start}\n"
                              "let_go: {source: back}\n"
                              "exchange: {source: left_thumb}\n" PAD_BUTTONS,
    [BUILT_IN_JOYSTICK] = "seldinger_device: 1\n"
                          "name: joystick\n"
                          "device: {joystick: \"*\"}\n"
                          "push: {source: axis_1, mm_s: 40, dead_zone: 0.1, exponent: 2, invert: true}\n"
                          "twist: {source: axis_0, deg_s: 240, dead_zone: 0.1, exponent: 2}\n"
                          "pedal: {source: button_0, optional: true}\n"
                          "contrast: {source: button_1, optional: true}\n"
                          "stop: {source: button_2, optional: true}\n"
                          "mark: {source: button_3, optional: true}\n",
    [BUILT_IN_HID_JOYSTICK] = "seldinger_device: 1\n"
                              "name: HID joystick\n"
                              "device: {usage: joystick}\n"
                              "push: [{source: Y, mm_s: 40, dead_zone: 0.1, exponent: 2, invert: true}, {source: hat_y, mm_s: 2, optional: true}]\n"
                              "twist: [{source: X, deg_s: 240, dead_zone: 0.1, exponent: 2}, {source: hat_x, deg_s: 20, optional: true}]\n" STICK_BUTTONS,
    [BUILT_IN_HID_GAMEPAD] = "seldinger_device: 1\n"
                             "name: HID gamepad\n"
                             "device: {usage: gamepad}\n"
                             "push: [{source: Y, mm_s: 40, dead_zone: 0.15, exponent: 2, invert: true}, {source: hat_y, mm_s: 2, optional: true}]\n"
                             "twist: [{source: X, deg_s: 240, dead_zone: 0.15, exponent: 2}, {source: hat_x, deg_s: 20, optional: true}]\n" STICK_BUTTONS,
    [BUILT_IN_HID_MULTI_AXIS] = "seldinger_device: 1\n"
                                "name: multi-axis controller\n"
                                "device: {usage: multi_axis}\n"
                                "push: {source: Y, mm_s: 40, dead_zone: 0.1, exponent: 2, kind: deflection, invert: true}\n"
                                "twist: {source: Rz, deg_s: 240, dead_zone: 0.1, exponent: 2, kind: deflection}\n" STICK_BUTTONS,
    [BUILT_IN_HID_HAPTIC] = "seldinger_device: 1\n"
                            "name: haptic joystick\n"
                            "device: {usage: joystick}\n"
                            "push: [{source: Y, mm_s: 40, dead_zone: 0.1, exponent: 2, invert: true}, {source: hat_y, mm_s: 2, optional: true}]\n"
                            "twist: [{source: X, deg_s: 240, dead_zone: 0.1, exponent: 2}, {source: hat_x, deg_s: 20, optional: true}]\n" STICK_BUTTONS
                            "force: {full_scale_n: 8, max_n: 4, slew_n_s: 200}\n",
};

const char *device_map_built_in_text(BuiltInMap which) { return texts[which]; }

DeviceMap *device_map_built_in(BuiltInMap which)
{
    Faults faults;
    faults_clear(&faults);
    return device_map_parse(texts[which], strlen(texts[which]), "built-in map", &faults);
}
