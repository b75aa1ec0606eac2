// Options; the drawing follows.
#include "render/fluoroscope.h"

#include "render/message.h"

FluoroscopeOptions fluoroscope_default_options(void)
{
    return (FluoroscopeOptions){.patient = patient_axes_lps(), .contrast_attenuation = 0.105, .quanta = 550, .dsa_gain = 2.2};
}

Fluoroscope *fluoroscope_create(const FluoroscopeOptions *options, char *message, size_t capacity)
{
    (void)options;
    message_fail(message, capacity, "fluoroscopy is not drawn yet");
    return NULL;
}

void fluoroscope_destroy(Fluoroscope *fluoroscope) { (void)fluoroscope; }
void fluoroscope_draw(Fluoroscope *fluoroscope, const FluoroscopeFrame *frame, ViewPort port) { (void)fluoroscope, (void)frame, (void)port; }
void fluoroscope_forget(Fluoroscope *fluoroscope) { (void)fluoroscope; }
FluoroscopeState fluoroscope_state(const Fluoroscope *fluoroscope)
{
    (void)fluoroscope;
    return (FluoroscopeState){.square = {0, 0, 0}};
}
