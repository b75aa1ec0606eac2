// Opens a scene, lets its script push the wire, and prints the force at the hand.
//   cc push_wire.c -o push_wire $(pkg-config --cflags --libs seldinger)
//   ./push_wire /usr/share/seldinger/scenes/phantom/scene.yaml
#include <stdio.h>

#include <seldinger/seldinger.h>

static int fail(const SelContext *context, SelStatus status)
{
    for (int i = 0; i < sel_fault_count(context); i++)
        fprintf(stderr, "push_wire: %s: %s\n", sel_status_name(status), sel_fault(context, i));
    return 2;
}

static SelStatus push(SelSimulator *simulator, long steps)
{
    SelStatus status = SEL_OK;
    printf("%6s %12s %10s %10s %9s\n", "t [s]", "inserted [mm]", "push [N]", "wall [N]", "contacts");
    for (long i = 1; i <= steps && status == SEL_OK; i++) {
        SelHand hand;
        sel_simulator_script_hand(simulator, &hand);
        status = sel_simulator_step(simulator, &hand);
        if (i % 500 == 0 && status == SEL_OK) {
            SelReport report;
            sel_simulator_report(simulator, &report, sizeof report);
            printf("%6.2f %12.2f %11.4f %10.4f %9d\n", sel_simulator_time_s(simulator), report.inserted_mm[0], report.push_n[0], report.wall_force_sum_n,
                   report.contacts);
        }
    }
    return status;
}

static void print_end(const SelSimulator *simulator)
{
    SelReport report;
    sel_simulator_report(simulator, &report, sizeof report);
    printf("push %.17g N, least %.17g N, most %.17g N\nstate %016llx\n", report.push_n[0], report.push_least_n, report.push_most_n,
           (unsigned long long)sel_simulator_hash(simulator));
}

int main(int argc, char **argv)
{
    const char *path = argc > 1 ? argv[1] : "/usr/share/seldinger/scenes/phantom/scene.yaml";
    SelContext *context = NULL;
    SelScene *scene = NULL;
    SelSimulator *simulator = NULL;
    SelStatus status = sel_context_create(NULL, &context);
    if (status == SEL_OK)
        status = sel_scene_open(context, path, NULL, &scene);
    if (status == SEL_OK)
        status = sel_simulator_create(context, scene, NULL, &simulator);
    if (status == SEL_OK)
        status = push(simulator, (long)(sel_scene_script_s(scene) / sel_scene_step_s(scene) + 0.5));
    if (status == SEL_OK)
        print_end(simulator);
    int code = status == SEL_OK ? 0 : fail(context, status);
    sel_simulator_destroy(simulator);
    sel_scene_destroy(scene);
    sel_context_destroy(context);
    return code;
}
