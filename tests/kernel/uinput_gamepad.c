// A gamepad that exists only in the kernel (uinput); programs see an Xbox 360 controller. Commands by standard input, one per line, each answered
// by `done`: `stick X Y` moves the left one (-32767..32767, Y > 0 towards the user), `button CODE VALUE` (linux/input-event-codes.h), `quit`.
#include <errno.h>
#include <fcntl.h>
#include <linux/uinput.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>
#include <sys/ioctl.h>
#include <unistd.h>

static const int buttons[] = {BTN_SOUTH, BTN_EAST, BTN_NORTH, BTN_WEST, BTN_TL, BTN_TR, BTN_SELECT, BTN_START, BTN_MODE, BTN_THUMBL, BTN_THUMBR};
static const struct {
    int code, least, most;
} axes[] = {{ABS_X, -32768, 32767},  {ABS_Y, -32768, 32767}, {ABS_Z, 0, 255},    {ABS_RX, -32768, 32767},
            {ABS_RY, -32768, 32767}, {ABS_RZ, 0, 255},       {ABS_HAT0X, -1, 1}, {ABS_HAT0Y, -1, 1}};

static bool plug(int fd)
{
    struct uinput_setup setup = {.id = {.bustype = BUS_USB, .vendor = 0x045e, .product = 0x028e, .version = 0x0114}, .name = "Microsoft X-Box 360 pad"};
    bool good = ioctl(fd, UI_SET_EVBIT, EV_KEY) == 0 && ioctl(fd, UI_SET_EVBIT, EV_ABS) == 0;
    for (size_t i = 0; i < sizeof buttons / sizeof buttons[0]; i++)
        good &= ioctl(fd, UI_SET_KEYBIT, buttons[i]) == 0;
    for (size_t i = 0; i < sizeof axes / sizeof axes[0]; i++) {
        struct uinput_abs_setup axis = {.code = (__u16)axes[i].code, .absinfo = {.minimum = axes[i].least, .maximum = axes[i].most}};
        good &= ioctl(fd, UI_ABS_SETUP, &axis) == 0;
    }
    return good && ioctl(fd, UI_DEV_SETUP, &setup) == 0 && ioctl(fd, UI_DEV_CREATE) == 0;
}

static bool send_event(int fd, int type, int code, int value)
{
    struct input_event event = {.type = (__u16)type, .code = (__u16)code, .value = value};
    return write(fd, &event, sizeof event) == (ssize_t)sizeof event;
}

int main(void)
{
    int fd = open("/dev/uinput", O_WRONLY | O_CLOEXEC), a, b;
    if (fd < 0 || !plug(fd)) {
        fprintf(stderr, "uinput_gamepad: /dev/uinput: %s\n", strerror(errno));
        return 1;
    }
    char line[128];
    while (fgets(line, sizeof line, stdin) && strcmp(line, "quit\n") != 0) {
        bool good = true;
        if (sscanf(line, "stick %d %d", &a, &b) == 2)
            good = send_event(fd, EV_ABS, ABS_X, a) && send_event(fd, EV_ABS, ABS_Y, b);
        else if (sscanf(line, "button %i %d", &a, &b) == 2)
            good = send_event(fd, EV_KEY, a, b);
        else
            good = false;
        good = good && send_event(fd, EV_SYN, SYN_REPORT, 0);
        printf("%s\n", good ? "done" : "FAILED");
        fflush(stdout);
    }
    ioctl(fd, UI_DEV_DESTROY);
    return 0;
}
