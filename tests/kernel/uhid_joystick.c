// A force-feedback joystick that exists only in the kernel (uhid): to every program it is a HID device on a bus. Commands come by standard input, one
// per line; each is answered by a line on standard output when it is done. Input reports go out every 8 ms while the device is open.
//   usage: uhid_joystick NAME VENDOR:PRODUCT LOG [SERIAL [LIE]]      (ids in hexadecimal)
// LIE: wide: its X has 64 bits; mixed: its input report has no id although others have one; full: it never has space for an effect. The kernel accepts all of
// them.
//   axis X DIAL      from now on the stick is at X (-32767..32767) and the dial turns by DIAL counts per report
//   yield K          the hand yields: X becomes X + K * force / 100, the force as the device plays it (-10000..10000, > 0 to greater X)
//   every MS         from now on the reports' interval
//   swing N          from now on X swings back and forth once in N reports and the dial turns by 1 count per report: its sum is the number of reports read
//   quiet | loud     no reports although open; reports again
//   flood N          N reports as fast as the kernel accepts them, the last with the dial at 0
//   short            one report of 2 bytes, where the descriptor says 6
//   unplug | plug    destroys the device, creates it again
//   wait WHAT [N]    answers when WHAT has happened: opened, closed, force (the device plays one), rest (none any more), reports (N more have
//                    gone out), written (N output and feature reports have come in all); gives up after 25 s
//   quit
// LOG: one event a line, `TIME_US KIND ...`: axis X (when it changes), sent X (each report of a swing, in place of axis), force F (what the motor does, when it
// changes), effect ... and fault TEXT (a report that the device class definition does not allow, USB HID PID 1.0: an effect that was never created, a wrong
// length ...). The device follows that definition by itself, sharing no code with the program under test: Create New Effect, PID Block Load, Set Effect,
// Set Constant Force, Effect Operation, PID Device Control, Device Gain, Block Free; its motor plays magnitude * gain while the effect runs.
#include <errno.h>
#include <fcntl.h>
#include <linux/input.h>
#include <linux/uhid.h>
#include <math.h>
#include <poll.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

enum { INPUT = 1, SET_EFFECT = 2, SET_CONSTANT = 5, OPERATION = 10, BLOCK_FREE = 11, CONTROL = 12, DEVICE_GAIN = 13 };   // ids of input and output reports
enum { CREATE_NEW = 16, BLOCK_LOAD = 17, POOL = 18 };                                                                   // of feature reports
enum { EFFECTS = 4, CONSTANT_FORCE = 1, INPUT_SIZE = 6, GIVE_UP_MS = 25000 };

static const unsigned char descriptor[] = {
    0x05, 0x01,  0x09,    0x04, 0xa1,         0x01, // Generic Desktop, Joystick, application
    0x85, INPUT, 0x09,    0x30, 0x16,         0x01,       0x80, 0x26,        0xff, 0x7f, 0x75, 0x10,    0x95, 0x01, 0x81, 0x02, // X: -32767..32767, 16 bits, absolute
    0x09, 0x37,  0x15,    0x81, 0x25,         0x7f,       0x75, 0x10,        0x81, 0x06, // Dial: -127..127, 16 bits, relative
    0x05, 0x09,  0x19,    0x01, 0x29,         0x08,       0x15, 0x00,        0x25, 0x01, 0x75, 0x01,    0x95, 0x08, 0x81, 0x02, // buttons 1 to 8
    0x05, 0x0f,  0x09,    0x21, 0xa1,         0x02,       0x85, SET_EFFECT,                                   // Physical Interface: Set Effect Report
    0x09, 0x22,  0x15,    0x01, 0x25,         EFFECTS,    0x75, 0x08,        0x95, 0x01, 0x91, 0x02,          // effect block index
    0x09, 0x25,  0xa1,    0x02, 0x09,         0x26,       0x15, 0x01,        0x25, 0x01, 0x91, 0x00,    0xc0, // effect type: constant force
    0x09, 0x50,  0x09,    0x54, 0x15,         0x00,       0x27, 0xff,        0xff, 0x00, 0x00, 0x66,    0x01, 0x10, 0x55, 0x0d, // duration, repeat interval, ms
    0x75, 0x10,  0x95,    0x02, 0x91,         0x02,       0x65, 0x00,        0x55, 0x00, 0x09, 0x52,    0x15, 0x00, 0x26, 0xff, 0x00,       0x75,
    0x08, 0x95,  0x01,    0x91, 0x02,                                                                                           // gain
    0x09, 0x53,  0x91,    0x02,                                                                                                 // trigger button
    0x09, 0x55,  0xa1,    0x02, 0x05,         0x01,       0x09, 0x01,        0xa1, 0x00, 0x09, 0x30,    0x15, 0x00, 0x25, 0x01, // axes enable: X
    0x75, 0x01,  0x95,    0x01, 0x91,         0x02,       0xc0, 0xc0,        0x05, 0x0f, 0x09, 0x56,    0x95, 0x01, 0x91, 0x02, 0x95,       0x06,
    0x91, 0x03,                                                                                                                 // direction enable, padding
    0x09, 0x57,  0xa1,    0x02, 0x0b,         0x01,       0x00, 0x0a,        0x00, 0x15, 0x00, 0x27,    0x9f, 0x8c, 0x00, 0x00, // direction, hundredths of a degree
    0x66, 0x14,  0x00,    0x55, 0x0e,         0x75,       0x10, 0x95,        0x01, 0x91, 0x02, 0x65,    0x00, 0x55, 0x00, 0xc0, 0xc0,       0x09,
    0x73, 0xa1,  0x02,    0x85, SET_CONSTANT, // Set Constant Force Report
    0x09, 0x22,  0x15,    0x01, 0x25,         EFFECTS,    0x75, 0x08,        0x95, 0x01, 0x91, 0x02,    0x09, 0x70, 0x16, 0xf0, 0xd8,       0x26,
    0x10, 0x27,  0x75,    0x10, 0x91,         0x02,       0xc0, // magnitude -10000..10000
    0x09, 0x77,  0xa1,    0x02, 0x85,         OPERATION,        // Effect Operation Report
    0x09, 0x22,  0x15,    0x01, 0x25,         EFFECTS,    0x75, 0x08,        0x95, 0x01, 0x91, 0x02,    0x09, 0x78, 0xa1, 0x02, 0x09,       0x79,
    0x09, 0x7a,  0x09,    0x7b, 0x15,         0x01,       0x25, 0x03,        0x91, 0x00, 0xc0, // start, solo, stop
    0x09, 0x7c,  0x15,    0x00, 0x26,         0xff,       0x00, 0x91,        0x02, 0xc0,       // loop count
    0x09, 0x90,  0xa1,    0x02, 0x85,         BLOCK_FREE, 0x09, 0x22,        0x15, 0x01, 0x25, EFFECTS, 0x91, 0x02, 0xc0, 0x09, 0x95,       0xa1,
    0x02, 0x85,  CONTROL, 0x09, 0x96,         0xa1,       0x02, // device control: enable, disable, stop all, reset, pause, continue
    0x09, 0x97,  0x09,    0x98, 0x09,         0x99,       0x09, 0x9a,        0x09, 0x9b, 0x09, 0x9c,    0x15, 0x01, 0x25, 0x06, 0x91,       0x00,
    0xc0, 0xc0,  0x09,    0x7d, 0xa1,         0x02,       0x85, DEVICE_GAIN, 0x09, 0x7e, 0x15, 0x00,    0x26, 0xff, 0x00, 0x91, 0x02,       0xc0,
    0x09, 0xab,  0xa1,    0x02, 0x85,         CREATE_NEW, // Create New Effect Report: type, bytes
    0x09, 0x25,  0xa1,    0x02, 0x09,         0x26,       0x15, 0x01,        0x25, 0x01, 0xb1, 0x00,    0xc0, 0x05, 0x01, 0x09, 0x3b,       0x15,
    0x00, 0x26,  0xff,    0x01, 0x75,         0x10,       0xb1, 0x02,        0xc0, 0x05, 0x0f, 0x09,    0x89, 0xa1, 0x02, 0x85, BLOCK_LOAD, // PID Block Load Report: index, status, pool available
    0x09, 0x22,  0x15,    0x00, 0x25,         EFFECTS,    0x75, 0x08,        0xb1, 0x02, 0x09, 0x8b,    0xa1, 0x02, 0x09, 0x8c, 0x09,       0x8d,
    0x09, 0x8e,  0x15,    0x01, 0x25,         0x03,       0xb1, 0x00,        0xc0, 0x09, 0xac, 0x15,    0x00, 0x27, 0xff, 0xff, 0x00,       0x00,
    0x75, 0x10,  0xb1,    0x02, 0xc0,         0x09,       0x7f, 0xa1,        0x02, 0x85, POOL, // PID Pool Report: size, effects at once, device managed
    0x09, 0x80,  0xb1,    0x02, 0x09,         0x83,       0x26, 0xff,        0x00, 0x75, 0x08, 0xb1,    0x02, 0x09, 0xa9, 0x09, 0xaa,       0x25,
    0x01, 0x75,  0x01,    0x95, 0x02,         0xb1,       0x02, 0x95,        0x06, 0xb1, 0x03, 0xc0,    0xc0,
};

typedef struct {
    bool made, configured, running;
    int gain, magnitude;
    int duration_ms;         // 0: for ever
    double along_x;          // fraction of a magnitude > 0 that pushes the stick to greater X
    long long ends_us;       // while it runs; 0: never
} Effect;

typedef struct {
    const char *name, *serial, *lie;
    unsigned vendor, product;
    int fd;
    FILE *log;
    bool plugged, open, quiet, actuators, paused;
    int device_gain, last_made;   // last_made: index in PID Block Load, 0 after a failure
    Effect effects[EFFECTS + 1];
    int base, dial, yield, axis, force, interval_ms;
    int swing;               // reports of one swing; 0: none
    long reports, written;
    long long next_us;
} Device;

static long long now_us(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (long long)t.tv_sec * 1000000 + t.tv_nsec / 1000;
}

__attribute__((format(printf, 2, 3))) static void note(Device *device, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    fprintf(device->log, "%lld ", now_us());
    vfprintf(device->log, format, arguments);
    fputc('\n', device->log);
    va_end(arguments);
}

static void send_event(const Device *device, const struct uhid_event *event)
{
    if (write(device->fd, event, sizeof *event) != (ssize_t)sizeof *event) {
        fprintf(stderr, "uhid_joystick: write: %s\n", strerror(errno));
        exit(1);
    }
}

// The descriptor, or a false one; returns its length in bytes.
static size_t describe(unsigned char *out, const char *lie)
{
    static const unsigned char id[] = {0x85, INPUT}, sixteen_bits[] = {0x75, 0x10};
    size_t length = sizeof descriptor, at = 0;
    const unsigned char *wanted = !strcmp(lie, "mixed") ? id : sixteen_bits;
    memcpy(out, descriptor, length);
    while (out[at] != wanted[0] || out[at + 1] != wanted[1])
        at++;
    if (!strcmp(lie, "wide"))
        out[at + 1] = 64;
    if (!strcmp(lie, "mixed"))
        memmove(out + at, out + at + 2, (length -= 2) - at);
    return length;
}

static void plug(Device *device)
{
    struct uhid_event event = {.type = UHID_CREATE2};
    snprintf((char *)event.u.create2.name, sizeof event.u.create2.name, "%s", device->name);
    snprintf((char *)event.u.create2.uniq, sizeof event.u.create2.uniq, "%s", device->serial);
    event.u.create2.rd_size = (unsigned short)describe(event.u.create2.rd_data, device->lie);
    event.u.create2.bus = BUS_USB;
    event.u.create2.vendor = device->vendor;
    event.u.create2.product = device->product;
    send_event(device, &event);
    device->plugged = true;
    device->open = false;
    device->actuators = true;
    device->paused = false;
    device->device_gain = 255;
    memset(device->effects, 0, sizeof device->effects);
}

static void unplug(Device *device)
{
    send_event(device, &(struct uhid_event){.type = UHID_DESTROY});
    device->plugged = device->open = false;
    note(device, "unplugged");
}

// The present force of the motor: the sum of the running effects, -10000..10000, > 0 to greater X.
static void update_force(Device *device)
{
    double total = 0;
    for (int i = 1; i <= EFFECTS; i++) {
        Effect *effect = &device->effects[i];
        if (effect->running && effect->ends_us && now_us() >= effect->ends_us)
            effect->running = false;
        if (effect->running)
            total += effect->along_x * effect->magnitude * effect->gain / 255;
    }
    int force = device->plugged && device->actuators && !device->paused ? (int)lround(total * device->device_gain / 255) : 0;
    if (force != device->force)
        note(device, "force %d", force);
    device->force = force;
}

static void send_report(Device *device, int dial, int size)
{
    update_force(device);
    if (device->swing)
        device->base = (int)lround(32767 * sin((double)(device->reports % device->swing) / device->swing * 2 * 3.14159265358979));
    int axis = device->base + device->yield * device->force / 100;
    axis = axis > 32767 ? 32767 : axis < -32767 ? -32767 : axis;
    if (device->swing)
        note(device, "sent %d", axis);
    else if (axis != device->axis)
        note(device, "axis %d", axis);
    device->axis = axis;
    struct uhid_event event = {.type = UHID_INPUT2};
    const unsigned char report[INPUT_SIZE] = {INPUT, (unsigned char)axis, (unsigned char)(axis >> 8), (unsigned char)dial, (unsigned char)(dial >> 8), 0};
    memcpy(event.u.input2.data, report, sizeof report);
    event.u.input2.size = (unsigned short)size;
    send_event(device, &event);
    device->reports++;
}

static int word(const unsigned char *bytes) { return (short)(bytes[0] | bytes[1] << 8); }

static Effect *named_effect(Device *device, int index, const char *what)
{
    if (index >= 1 && index <= EFFECTS && device->effects[index].made)
        return &device->effects[index];
    note(device, "fault %s names effect %d, which was not created", what, index);
    return NULL;
}

static void operate(Device *device, Effect *effect, int operation)
{
    if (operation < 1 || operation > 3)
        note(device, "fault operation %d", operation);
    if ((operation == 1 || operation == 2) && !effect->configured)
        note(device, "fault an effect is started before Set Effect");
    if (operation == 2)
        for (int i = 1; i <= EFFECTS; i++)
            device->effects[i].running = false;
    effect->running = operation == 1 || operation == 2;
    effect->ends_us = effect->duration_ms ? now_us() + effect->duration_ms * 1000LL : 0;
}

static void control(Device *device, int what)
{
    if (what == 1 || what == 2)
        device->actuators = what == 1;
    else if (what == 5 || what == 6)
        device->paused = what == 5;
    else if (what == 3)
        for (int i = 1; i <= EFFECTS; i++)
            device->effects[i].running = false;
    else if (what == 4) {
        memset(device->effects, 0, sizeof device->effects);
        device->paused = false;
        device->device_gain = 255;
    } else
        note(device, "fault device control %d", what);
}

static void take_output(Device *device, const unsigned char *bytes, int size)
{
    static const struct {
        int id, size;
        const char *name;
    } known[] = {{SET_EFFECT, 12, "Set Effect"}, {SET_CONSTANT, 4, "Set Constant Force"}, {OPERATION, 4, "Effect Operation"},
                 {BLOCK_FREE, 2, "Block Free"},  {CONTROL, 2, "Device Control"},          {DEVICE_GAIN, 2, "Device Gain"}};
    const char *name = NULL;
    for (size_t i = 0; size > 0 && i < sizeof known / sizeof known[0]; i++)
        if (known[i].id == bytes[0] && known[i].size == size)
            name = known[i].name;
    device->written++;
    if (!name) {
        note(device, "fault output report %d of %d bytes", size > 0 ? bytes[0] : -1, size);
        return;
    }
    Effect *effect = bytes[0] == CONTROL || bytes[0] == DEVICE_GAIN ? NULL : named_effect(device, bytes[1], name);
    if (bytes[0] == CONTROL)
        control(device, bytes[1]);
    else if (bytes[0] == DEVICE_GAIN)
        device->device_gain = bytes[1];
    else if (!effect)
        return;
    else if (bytes[0] == SET_EFFECT) {
        int duration = word(bytes + 3) & 0xffff;
        effect->configured = true;
        effect->gain = bytes[7];
        // the direction is where a force comes from, clockwise from north (DirectInput; Linux's FF says the same the other way round): 90 degrees pushes
        // to the left
        effect->along_x = bytes[9] & 2 ? -sin((word(bytes + 10) & 0xffff) / 100.0 * 3.14159265358979 / 180) : -(bytes[9] & 1);
        effect->duration_ms = duration == 0xffff ? 0 : duration;
        if (bytes[2] != CONSTANT_FORCE)
            note(device, "fault effect type %d", bytes[2]);
        note(device, "effect %d lasts %d ms gain %d axes %d direction %d", bytes[1], duration, effect->gain, bytes[9] & 3, word(bytes + 10) & 0xffff);
    } else if (bytes[0] == SET_CONSTANT) {
        effect->magnitude = word(bytes + 2);
        if (abs(effect->magnitude) > 10000)
            note(device, "fault magnitude %d", effect->magnitude);
        note(device, "magnitude %d", effect->magnitude);
    } else if (bytes[0] == OPERATION)
        operate(device, effect, bytes[2]);
    else
        *effect = (Effect){0};
    update_force(device);
}

static void take_feature(Device *device, const struct uhid_set_report_req *request)
{
    struct uhid_event answer = {.type = UHID_SET_REPORT_REPLY};
    answer.u.set_report_reply.id = request->id;
    device->written++;
    if (request->rtype == UHID_OUTPUT_REPORT) {
        take_output(device, request->data, request->size);
    } else if (request->rnum == CREATE_NEW && request->size == 4 && request->data[1] == CONSTANT_FORCE) {
        device->last_made = 0;
        for (int i = EFFECTS; i >= 1; i--)
            if (!device->effects[i].made && strcmp(device->lie, "full") != 0)
                device->last_made = i;
        if (device->last_made)
            device->effects[device->last_made] = (Effect){.made = true};
        note(device, "created %d", device->last_made);
    } else {
        note(device, "fault feature report %d of %d bytes", request->rnum, request->size);
        answer.u.set_report_reply.err = EIO;
    }
    send_event(device, &answer);
}

static void give_feature(Device *device, const struct uhid_get_report_req *request)
{
    struct uhid_event answer = {.type = UHID_GET_REPORT_REPLY};
    const unsigned char load[] = {BLOCK_LOAD, (unsigned char)device->last_made, device->last_made ? 1 : 2, 0x00, 0x10};
    const unsigned char pool[] = {POOL, 0x00, 0x10, EFFECTS, 1};
    const unsigned char *data = request->rnum == BLOCK_LOAD ? load : request->rnum == POOL ? pool : NULL;
    answer.u.get_report_reply.id = request->id;
    if (data) {
        answer.u.get_report_reply.size = sizeof load;
        memcpy(answer.u.get_report_reply.data, data, sizeof load);
    } else {
        note(device, "fault asked for feature report %d", request->rnum);
        answer.u.get_report_reply.err = EIO;
    }
    send_event(device, &answer);
}

static void take_event(Device *device)
{
    struct uhid_event event;
    if (read(device->fd, &event, sizeof event) <= 0)
        return;
    if (event.type == UHID_OPEN || event.type == UHID_CLOSE) {
        device->open = event.type == UHID_OPEN;
        device->next_us = now_us();
        note(device, device->open ? "opened" : "closed");
    } else if (event.type == UHID_OUTPUT)
        take_output(device, event.u.output.data, event.u.output.size);
    else if (event.type == UHID_SET_REPORT)
        take_feature(device, &event.u.set_report);
    else if (event.type == UHID_GET_REPORT)
        give_feature(device, &event.u.get_report);
}

// Reads events of the kernel and sends the input report that is due. On a slow machine reports are skipped, as a real device does not catch up.
static void turn(Device *device, struct pollfd *commands)
{
    const int wait_ms = device->force || device->interval_ms < 4 ? 1 : 4;   // so that the end of an effect is noticed in time
    struct pollfd both[2] = {{.fd = device->fd, .events = POLLIN}, {.fd = commands ? commands->fd : -1, .events = POLLIN}};
    if (poll(both, 2, wait_ms) > 0 && both[0].revents & POLLIN)
        take_event(device);
    if (commands)
        commands->revents = both[1].revents;
    update_force(device);
    long long now = now_us();
    if (device->plugged && device->open && !device->quiet && now >= device->next_us) {
        send_report(device, device->dial, INPUT_SIZE);
        device->next_us = (now - device->next_us > 20000 ? now : device->next_us) + 1000 * device->interval_ms;
    }
}

static bool wait_for(Device *device, const char *what, long count)
{
    const long long until = now_us() + GIVE_UP_MS * 1000LL;
    const long reports = device->reports + count;
    while (now_us() < until) {
        if (!strcmp(what, "opened") && device->open)
            return true;
        if (!strcmp(what, "closed") && !device->open)
            return true;
        if (!strcmp(what, "force") && device->force != 0)
            return true;
        if (!strcmp(what, "rest") && device->force == 0)
            return true;
        if (!strcmp(what, "reports") && device->reports >= reports)
            return true;
        if (!strcmp(what, "written") && device->written >= count)
            return true;
        turn(device, NULL);
    }
    return false;
}

// Executes one command; false if it was `quit`. The result is written to standard output.
static bool obey(Device *device, char *line)
{
    char verb[16] = "", what[16] = "";
    long a = 0, b = 0;
    if (sscanf(line, "%15s", verb) != 1)
        return true;
    const char *rest = line + strspn(line, " ") + strlen(verb);
    bool good = true;
    double took = 0;
    if (!strcmp(verb, "quit"))
        return false;
    if (!strcmp(verb, "axis") && sscanf(rest, "%ld %ld", &a, &b) == 2) {
        device->base = (int)a;
        device->dial = (int)b;
    } else if (!strcmp(verb, "yield") && sscanf(rest, "%ld", &a) == 1)
        device->yield = (int)a;
    else if (!strcmp(verb, "every") && sscanf(rest, "%ld", &a) == 1 && a > 0)
        device->interval_ms = (int)a;
    else if (!strcmp(verb, "swing") && sscanf(rest, "%ld", &a) == 1 && a > 0) {
        device->swing = (int)a;
        device->dial = 1;
    } else if (!strcmp(verb, "quiet") || !strcmp(verb, "loud"))
        device->quiet = verb[0] == 'q';
    else if (!strcmp(verb, "flood") && sscanf(rest, "%ld", &a) == 1) {
        long long begin = now_us();
        for (long i = 0; i < a; i++)
            send_report(device, i + 1 < a ? device->dial : 0, INPUT_SIZE);
        took = (double)(now_us() - begin) / 1e6;
    } else if (!strcmp(verb, "short"))
        send_report(device, 0, 2);
    else if (!strcmp(verb, "unplug") && device->plugged)
        unplug(device);
    else if (!strcmp(verb, "plug") && !device->plugged)
        plug(device);
    else if (!strcmp(verb, "wait") && sscanf(rest, "%15s %ld", what, &a) >= 1)
        good = wait_for(device, what, a);
    else
        good = false;
    fflush(device->log);
    printf("%s: %s, %ld reports sent, %ld received, force %d", verb, good ? "done" : "FAILED", device->reports, device->written, device->force);
    if (took > 0)
        printf(", took %.2f s", took);
    printf("\n");
    fflush(stdout);
    return true;
}

int main(int argc, char **argv)
{
    Device device = {.fd = open("/dev/uhid", O_RDWR | O_CLOEXEC), .axis = 1 << 20, .interval_ms = 8};
    if (argc < 4 || argc > 6 || sscanf(argv[2], "%x:%x", &device.vendor, &device.product) != 2) {
        fprintf(stderr, "usage: uhid_joystick NAME VENDOR:PRODUCT LOG [SERIAL [wide|mixed|full]]\n");
        return 2;
    }
    device.name = argv[1];
    device.serial = argc > 4 ? argv[4] : "";
    device.lie = argc > 5 ? argv[5] : "";
    device.log = fopen(argv[3], "w");
    if (device.fd < 0 || !device.log) {
        fprintf(stderr, "uhid_joystick: %s: %s\n", device.fd < 0 ? "/dev/uhid" : argv[3], strerror(errno));
        return 1;
    }
    plug(&device);
    struct pollfd commands = {.fd = STDIN_FILENO, .events = POLLIN};
    char line[256];
    size_t length = 0;
    for (bool going = true; going;) {
        turn(&device, &commands);
        if (!(commands.revents & (POLLIN | POLLHUP)))
            continue;
        ssize_t got = read(STDIN_FILENO, line + length, 1);
        if (got <= 0)
            break;
        if (line[length] != '\n' && length + 2 < sizeof line) {
            length++;
            continue;
        }
        line[length] = '\0';
        length = 0;
        going = obey(&device, line);
    }
    if (device.plugged)
        unplug(&device);
    fclose(device.log);
    return 0;
}
