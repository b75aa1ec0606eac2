#include "render/settings_in_force.h"

#include "render/operator_controls.h"
#include "render/window.h"

static double signed_factor(double factor, bool is_inverted) { return is_inverted ? -factor : factor; }

void settings_put_in_force(const Settings *settings)
{
    const SpeedSettings *speed = &settings->speed;
    key_table_bind(settings->key);
    key_sheet_bind(settings->sheet_key);
    window_scale_letters(settings->interface_scale);
    controls_use_speeds(&(OperatorSpeeds){signed_factor(speed->insertion, speed->insertion_inverted), signed_factor(speed->rotation, speed->rotation_inverted),
                                          signed_factor(speed->c_arm, speed->sideways_inverted), signed_factor(speed->c_arm, speed->tilt_inverted)});
}
