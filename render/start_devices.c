#include "render/start_devices.h"

#include "render/translation.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef enum { ROW_HID, ROW_USB, ROW_JOYSTICK, ROW_NONE } RowKind;

struct DevicesPage {
    const HidTransport *transport;
    HidTransport *own;
    DeviceList *list;
    WindowGamepad pad[WINDOW_GAMEPADS];
    int pad_index[WINDOW_GAMEPADS], pad_count;
    Watched watched;             // the HID device of `watched_row`
    int watched_row;             // -1: none
    bool is_learning, learns_twist;
    uint8_t bytes[HID_REPORT_BYTES];
    char message[700];
};

static void close_list(DevicesPage *page)
{
    if (page->watched_row >= 0 && page->transport)
        watched_close(page->transport, &page->watched);
    page->watched_row = -1;
    page->is_learning = false;
    device_list_free(page->list);
    page->list = NULL;
}

DevicesPage *devices_page_open(const HidTransport *transport)
{
    DevicesPage *page = calloc(1, sizeof *page);
    if (page) {
        page->watched_row = -1;
        page->own = transport ? NULL : hid_transport_hidapi();
        page->transport = transport ? transport : page->own;
    }
    return page;
}

void devices_page_close(DevicesPage *page)
{
    if (!page)
        return;
    close_list(page);
    hid_transport_hidapi_free(page->own);
    free(page);
}

void devices_page_look(DevicesPage *page, Window *window)
{
    Faults *faults = calloc(1, sizeof *faults);
    close_list(page);
    page->message[0] = 0;
    page->list = faults ? calloc(1, sizeof *page->list) : NULL;
    if (page->list) {
        if (!device_list_load_maps(page->list, 0, NULL, faults))
            snprintf(page->message, sizeof page->message, "%s", faults->text[0]);
        device_list_look(page->list, page->transport);
    }
    page->pad_count = 0;
    for (int i = 0; window && i < WINDOW_GAMEPADS; i++)
        if (window_gamepad(window, i, &page->pad[page->pad_count]))
            page->pad_index[page->pad_count++] = i;
    free(faults);
}

static RowKind kind_of(const DevicesPage *page, int row, int *index)
{
    const int hid = page->list ? page->list->hid_count : 0, usb = page->list ? page->list->usb_count : 0;
    *index = row < hid ? row : row < hid + usb ? row - hid : row - hid - usb;
    return row < 0 ? ROW_NONE : row < hid ? ROW_HID : row < hid + usb ? ROW_USB : *index < page->pad_count ? ROW_JOYSTICK : ROW_NONE;
}

int devices_page_rows(const DevicesPage *page) { return (page->list ? page->list->hid_count + page->list->usb_count : 0) + page->pad_count; }

void devices_page_describe(const DevicesPage *page, int row, char left[300], char right[200])
{
    int i;
    left[0] = right[0] = 0;
    switch (kind_of(page, row, &i)) {
    case ROW_HID: {
        const HidListing *hid = &page->list->hid[i];
        snprintf(left, 300, "%.120s  %.100s", hid->info.product[0] ? hid->info.product : tr("device without a name"), hid->info.path);
        snprintf(right, 200, "%s%.100s", hid->is_usable ? "" : tr("cannot steer"), hid->is_usable && hid->map ? hid->map->name : "");
        break;
    }
    case ROW_USB:
        snprintf(left, 300, tr("USB serial chip  %04x:%04x %.60s"), (unsigned)page->list->usb[i].vendor_id, (unsigned)page->list->usb[i].product_id,
                 page->list->usb[i].serial);
        snprintf(right, 200, "%.100s", page->list->usb_map[i] ? page->list->usb_map[i]->name : tr("no map"));
        break;
    case ROW_JOYSTICK:
        snprintf(left, 300, "%.128s", page->pad[i].name);
        snprintf(right, 200, "%s", page->pad[i].is_mapped ? tr("gamepad") : tr("joystick"));
        break;
    case ROW_NONE: break;
    }
}

const char *devices_page_about(const DevicesPage *page, int row)
{
    int i;
    RowKind kind = kind_of(page, row, &i);
    if (page->message[0])
        return page->message;
    if (!page->transport || (page->list && !page->list->has_hidraw))
        return tr(
            "This system shows no HID devices: the kernel's hidraw is missing, as in many containers. Keyboard, and gamepads known to the system, still work.");
    if (kind == ROW_HID && page->list->hid[i].why[0])
        return page->list->hid[i].why;
    if (kind == ROW_USB && !page->list->usb_map[i])
        return tr("A serial encoder needs a map of its own: scenes/devices/serial_encoder.yaml is an example, for nav --device.");
    if (kind == ROW_JOYSTICK)
        return tr("A built-in map drives the tool: forward pushes, right turns clockwise. Other axes need a map: scenes/devices/gamepad.yaml is an example.");
    return kind == ROW_HID
               ? tr("Move a control to see its values. {learn_push} and {learn_turn} assign the axes that push and turn: press the key, then move the axis.")
               : "";
}

static void save_learned(DevicesPage *page, const LearnedAxis *found)
{
    Faults *faults = calloc(1, sizeof *faults);
    const HidListing *hid = page->watched.listing;
    const HidDeviceInfo info = hid->info;
    LearnedAxis push = learned_axis_of(hid->map, false), twist = learned_axis_of(hid->map, true);
    *(page->learns_twist ? &twist : &push) = *found;
    LearnedAxis *other = page->learns_twist ? &push : &twist;
    if (other->usage == found->usage && other->index == found->index)
        other->is_learned = false;       // an axis does one thing
    char *text = learned_map_text(&info, &push, &twist), name[32];
    bool good = faults && text && own_map_save(info.vendor_id, info.product_id, text, faults);
    hid_usage_name(found->usage, name, sizeof name);
    const bool is_twist = page->learns_twist;
    devices_page_look(page, NULL);
    if (good)
        snprintf(page->message, sizeof page->message,
                 is_twist ? tr("%s turns the tool now. The map is kept with your settings.")
                          : tr("%s pushes the tool now. The map is kept with your settings."),
                 name);
    else
        snprintf(page->message, sizeof page->message, "%s", faults && faults->count > 0 ? faults->text[0] : tr("The map could not be kept."));
    free(text);
    free(faults);
}

void devices_page_read(DevicesPage *page, int row)
{
    int i;
    RowKind kind = kind_of(page, row, &i);
    if (page->watched_row != row) {
        if (page->watched_row >= 0)
            watched_close(page->transport, &page->watched);
        page->watched_row = -1;
        page->is_learning = false;
        if (kind == ROW_HID && page->transport && watched_open(page->transport, &page->list->hid[i], &page->watched))
            page->watched_row = row;
    }
    if (page->watched_row < 0)
        return;
    LearnedAxis found;
    watched_read(page->transport, &page->watched, 0, page->bytes);
    watched_publish(&page->watched);
    if (page->is_learning && learned_axis_find(&page->watched, &found))
        save_learned(page, &found);
}

static void draw_watched(const DevicesPage *page, Gui *gui)
{
    const Watched *watched = &page->watched;
    char name[40], value[120];
    for (int i = 0; i < watched->control_count; i++) {
        const WatchedControl *control = &watched->control[i];
        hid_usage_name(control->field.usage, name, sizeof name);
        if (!control->has_value)
            continue;
        if (control->field.flags & HID_RELATIVE)
            snprintf(value, sizeof value, tr("%lld counts"), (long long)control->sum);
        else
            snprintf(value, sizeof value, tr("%lld  (%lld to %lld so far)"), (long long)control->value, (long long)control->least, (long long)control->most);
        gui_row(gui, GUI_SMALL, name, gui_colors.text, value);
    }
    if (!watched->is_mapped)
        return;
    const HandPort *port = watched->port;
    snprintf(value, sizeof value, tr("%.1f mm/s, %.1f deg/s"), atomic_load(&port->push_mm_s), atomic_load(&port->twist_deg_s));
    gui_row(gui, GUI_SMALL, "The tool", gui_colors.accent, value);
    snprintf(value, sizeof value, tr("%.2f mm, %.1f deg"), atomic_load(&port->advanced_mm), atomic_load(&port->turned_deg));
    gui_row(gui, GUI_SMALL, "Way so far", gui_colors.accent, value);
}

static void draw_pad(const DevicesPage *page, Gui *gui, Window *window, int i)
{
    WindowGamepad pad;
    char name[40], value[40];
    if (!window || !window_gamepad(window, page->pad_index[i], &pad))
        return;
    for (int k = 0; k < pad.axis_count; k++) {
        snprintf(name, sizeof name, "axis_%d", k);
        snprintf(value, sizeof value, "%.2f", (double)pad.axis[k]);
        gui_row(gui, GUI_SMALL, name, gui_colors.text, value);
    }
    for (int k = 0; k < pad.button_count; k++)
        if (pad.button[k]) {
            snprintf(name, sizeof name, "button_%d", k);
            gui_row(gui, GUI_SMALL, name, gui_colors.text, tr("pressed"));
        }
}

void devices_page_draw(const DevicesPage *page, Gui *gui, Window *window, int row)
{
    int i;
    RowKind kind = kind_of(page, row, &i);
    if (kind == ROW_HID && page->watched_row == row) {
        gui_text(gui, GUI_SMALL, gui_colors.accent, page->watched.device ? "Its values" : "It was unplugged");
        draw_watched(page, gui);
    } else if (kind == ROW_JOYSTICK) {
        gui_text(gui, GUI_SMALL, gui_colors.accent, "Its values");
        draw_pad(page, gui, window, i);
    }
}

bool devices_page_can_learn(const DevicesPage *page, int row)
{
    int i;
    return kind_of(page, row, &i) == ROW_HID && page->watched_row == row && page->watched.device;
}

void devices_page_learn(DevicesPage *page, int row, bool is_twist)
{
    if (!devices_page_can_learn(page, row))
        return;
    page->is_learning = true;
    page->learns_twist = is_twist;
    watched_forget(&page->watched);
    snprintf(page->message, sizeof page->message, "%s",
             is_twist ? tr("Move the axis that shall turn the tool, to the right. Esc: leave it as it is.")
                      : tr("Move the axis that shall push the tool, forward. Esc: leave it as it is."));
}

bool devices_page_is_learning(const DevicesPage *page) { return page && page->is_learning; }

void devices_page_stop_learning(DevicesPage *page)
{
    page->is_learning = false;
    page->message[0] = 0;
}
