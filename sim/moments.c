#include "sim/moments.h"

#include <math.h>

bool moments_open(Moments *moments, Simulator *simulator, int count, const double *at_s)
{
    bool good = true;
    *moments = (Moments){.count = count > 0 ? count : 1, .at_s = {HUGE_VAL}};
    for (int i = 0; i < count; i++)
        moments->at_s[i] = at_s[i];
    for (int i = 0; good && i < moments->count; i++)
        good = (moments->pose[i] = pose_create_for(simulator)) != NULL;
    return good;
}

static void take(Moments *moments, int i, Simulator *simulator, const ToolCommands *commands)
{
    const XrayControl xray = xray_default_control();
    pose_take(moments->pose[i], simulator, commands, &xray);
    moments->is_taken[i] = true;
}

void moments_step(Moments *moments, Simulator *simulator, const ToolCommands *commands)
{
    for (int i = 0; i < moments->count; i++)
        if (!moments->is_taken[i] && simulator_time_s(simulator) >= moments->at_s[i] - 1e-9)
            take(moments, i, simulator, commands);
}

void moments_end(Moments *moments, Simulator *simulator)
{
    for (int i = 0; i < moments->count; i++)
        if (moments->at_s[i] == HUGE_VAL)
            take(moments, i, simulator, &(ToolCommands){0});
}

void moments_close(Moments *moments)
{
    for (int i = 0; i < moments->count; i++)
        pose_free(moments->pose[i]);
    *moments = (Moments){0};
}
