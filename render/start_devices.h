// The page of devices in the start window: what is connected, which map applies, live values, and learning of axes by moving them.
#ifndef SELDINGER_RENDER_START_DEVICES_H
#define SELDINGER_RENDER_START_DEVICES_H

#include "input/input.h"
#include "render/gui.h"

typedef struct DevicesPage DevicesPage;

// `transport`: as for hands_open; NULL: hidapi. Returns NULL if out of memory.
DevicesPage *devices_page_open(const HidTransport *transport);
void devices_page_close(DevicesPage *page);
// Looks again at what is connected. `window` may be NULL: no joysticks by GLFW.
void devices_page_look(DevicesPage *page, Window *window);

int devices_page_rows(const DevicesPage *page);
void devices_page_describe(const DevicesPage *page, int row, char left[300], char right[200]);
// What is wrong with the device, or where its values go. "": nothing to say.
const char *devices_page_about(const DevicesPage *page, int row);
// Reads the device of a row, whose values devices_page_draw shows, and learns from it. Call once per frame.
void devices_page_read(DevicesPage *page, int row);
void devices_page_draw(const DevicesPage *page, Gui *gui, Window *window, int row);
// Whether the axes of a row can be learned.
bool devices_page_can_learn(const DevicesPage *page, int row);
// Waits for a movement that shall push or twist; the map is saved when it comes.
void devices_page_learn(DevicesPage *page, int row, bool is_twist);
bool devices_page_is_learning(const DevicesPage *page);
void devices_page_stop_learning(DevicesPage *page);

#endif
