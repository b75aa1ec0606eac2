// A loop at 1 kHz as a haptic device needs it: read the hand, step, give the force back. The tube and the wire are built in code; a device stands in for yours.
//   cc haptic_loop.c -o haptic_loop $(pkg-config --cflags --libs seldinger) -lm
//   ./haptic_loop [SECONDS]
#define _POSIX_C_SOURCE 200809L
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include <seldinger/seldinger.h>

// --- your device: here a hand that pushes to and fro, and whoever feels the force ---

typedef struct Device {
    double felt_n, most_n;
} Device;

static SelHand device_read(double t_s)
{
    SelHand hand = sel_hand_still();
    hand.tool[0].push_mm_s = 40 * sin(2 * t_s);
    hand.tool[0].twist_deg_s = 90;
    return hand;
}

static void device_write(Device *device, double force_n)
{
    device->felt_n = force_n;
    device->most_n = fmax(device->most_n, fabs(force_n));
}

// --- a wire in a bent tube ---

static SelStatus build(SelContext *context, SelScene **scene)
{
    const SelPiece piece[2] = {{20, 0, 0, 0}, {0, 15, 180, 0}};      // a line of 20 mm, then a half circle of radius 15 mm
    const SelSection section[1] = {{150, 0.36, 0, 60, 0.3, 6.45, 0, 0}};
    SelVesselOptions vessel = sel_vessel_defaults();
    vessel.source = SEL_VESSEL_TUBE;
    vessel.radius_mm = 1.5;
    vessel.friction = 0.05;
    vessel.piece_count = 2;
    vessel.piece = piece;
    SelToolOptions wire = sel_tool_defaults();
    wire.name = "wire";
    wire.section_count = 1;
    wire.section = section;
    wire.elements = 100;
    wire.inserted_mm = 15;
    wire.damping_mass_1_s = 0.1;
    wire.damping_stiffness_s = 0.0002;
    SelSceneOptions options = sel_scene_defaults();
    options.vessel = &vessel;
    options.tool_count = 1;
    options.tool = &wire;
    return sel_scene_build(context, &options, NULL, scene);
}

// --- the loop: absolute deadlines, so that nothing adds up ---

static void add_ms(struct timespec *at, long ms)
{
    at->tv_nsec += ms * 1000000;
    at->tv_sec += at->tv_nsec / 1000000000;
    at->tv_nsec %= 1000000000;
}

static double late_ms(const struct timespec *due)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)(now.tv_sec - due->tv_sec) * 1e3 + (double)(now.tv_nsec - due->tv_nsec) * 1e-6;
}

static SelStatus loop(SelSimulator *simulator, Device *device, long steps)
{
    struct timespec due;
    long late = 0;
    double worst_ms = 0;
    SelStatus status = SEL_OK;
    clock_gettime(CLOCK_MONOTONIC, &due);
    for (long i = 0; i < steps && status == SEL_OK; i++) {
        SelReport report;
        SelHand hand = device_read(sel_simulator_time_s(simulator));
        status = sel_simulator_step(simulator, &hand);
        sel_simulator_report(simulator, &report, sizeof report);
        device_write(device, report.push_n[0]);
        add_ms(&due, 1);
        double by = late_ms(&due);
        late += by > 0;
        worst_ms = fmax(worst_ms, by);
        if (by <= 0)
            clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &due, NULL);
        else
            clock_gettime(CLOCK_MONOTONIC, &due);        // time slows down: no step is skipped
    }
    printf("%ld steps, %ld late, the worst by %.2f ms; the largest force was %.3f N\n", steps, late, worst_ms, device->most_n);
    return status;
}

int main(int argc, char **argv)
{
    SelContext *context = NULL;
    SelScene *scene = NULL;
    SelSimulator *simulator = NULL;
    Device device = {0, 0};
    long steps = (long)(1000 * (argc > 1 ? atof(argv[1]) : 5));
    SelStatus status = sel_context_create(NULL, &context);
    if (status == SEL_OK)
        status = build(context, &scene);
    if (status == SEL_OK)
        status = sel_simulator_create(context, scene, NULL, &simulator);
    if (status == SEL_OK)
        status = loop(simulator, &device, steps);
    for (int i = 0; i < sel_fault_count(context); i++)
        fprintf(stderr, "haptic_loop: %s\n", sel_fault(context, i));
    sel_simulator_destroy(simulator);
    sel_scene_destroy(scene);
    sel_context_destroy(context);
    return status == SEL_OK ? 0 : 2;
}
