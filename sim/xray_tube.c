#include "sim/xray_tube.h"

#include "base/base.h"

#include <math.h>

static const double output_ugy_mas = 0.008373, output_power = 1.983, output_mm = 1016;
static const double detector_ugy = 0.03, detector_side_mm = 220, couch_and_grid = 2.0 / 3;
static const double most_rate_mgy_min = 88, most_kw = 80;
static const double fluoroscopy_ms = 8, dsa_ms = 25;
// Within them the vessel is taken for one of the head.
static const double head_room_mm[3] = {66, 86, 104};

XrayPatient xray_patient_head(void) { return (XrayPatient){{78, 98, 116}, 1.05}; }
XrayPatient xray_patient_trunk(void) { return (XrayPatient){{170, 115, 260}, 0.85}; }

XrayPatient xray_patient_around(const VesselTree *tree, Vec3 anterior, Vec3 superior)
{
    if (!(vec3_norm(anterior) > 0) || !(vec3_norm(superior) > 0))
        anterior = vec3(0, -1, 0), superior = vec3(0, 0, 1);
    const Vec3 axis[3] = {vec3_cross(anterior, superior), anterior, superior};
    bool fits = true;
    for (int k = 0; tree && k < 3; k++) {
        double low = HUGE_VAL, high = -HUGE_VAL;
        for (int i = 0; i < tree->node_count; i++) {
            double at = vec3_dot(axis[k], tree->center[i]);
            low = fmin(low, at - tree->radius[i]);
            high = fmax(high, at + tree->radius[i]);
        }
        fits = fits && high - low < 2 * head_room_mm[k];
    }
    return fits ? xray_patient_head() : xray_patient_trunk();
}

static double clamped(double value, double least, double most) { return isfinite(value) ? fmin(fmax(value, least), most) : least; }

double xray_patient_water_mm(const XrayPatient *patient, double lao_deg, double cra_deg)
{
    double theta = clamped(lao_deg, -90, 90) * PI / 180, phi = clamped(cra_deg, -45, 45) * PI / 180, sum = 0;
    const double along[3] = {same_cos(phi) * same_sin(theta), same_cos(phi) * same_cos(theta), same_sin(phi)};
    for (int k = 0; k < 3; k++)
        sum += along[k] * along[k] / (patient->half_mm[k] * patient->half_mm[k]);
    return 2 / sqrt(sum) * patient->water;
}

double xray_output_ugy_mas(double kv, double distance_mm)
{
    double nearer = output_mm / distance_mm;
    return output_ugy_mas * same_pow(kv, output_power) * nearer * nearer;
}

// [1/mm] of water at an energy in keV, interpolated between the logarithms.
static double attenuation_of_water(double kev)
{
    static const double table[][2] = {{30, 0.03756}, {40, 0.02683}, {50, 0.02269}, {60, 0.02059}, {80, 0.01837}, {100, 0.01707}};
    enum { ROWS = sizeof table / sizeof table[0] };
    int i = 0;
    while (i < ROWS - 2 && kev > table[i + 1][0])
        i++;
    double t = same_log(kev / table[i][0]) / same_log(table[i + 1][0] / table[i][0]);
    return table[i][1] * same_pow(table[i + 1][1] / table[i][1], t);
}

static double open_part(const float blade[4])
{
    double wide = 1 - 0.5 * ((double)blade[0] + blade[1]), high = 1 - 0.5 * ((double)blade[2] + blade[3]);
    return fmax(wide, 0) * fmax(high, 0);
}

XrayExposure xray_expose(const XrayPatient *patient, const XrayControl *xray)
{
    bool is_dsa = lroundf(xray->mode) == XRAY_DSA;
    double water = xray_patient_water_mm(patient, (double)xray->lao_deg, (double)xray->cra_deg);
    double field = clamped((double)xray->field_mm, 40, 400), rate = clamped((double)xray->pulses_s, 1, 1000);
    double kv = clamped(50 + 0.13 * water, 60, 125), width = is_dsa ? dsa_ms : fluoroscopy_ms;
    double transmitted = couch_and_grid * same_exp(-attenuation_of_water(0.7 * kv) * water);
    double wanted = detector_ugy * detector_side_mm / (field * XRAY_DETECTOR_MM / XRAY_SOURCE_MM) * (is_dsa ? XRAY_DSA_DOSE : 1);
    double farther = XRAY_DETECTOR_MM / XRAY_REFERENCE_MM, kerma_ugy = wanted / transmitted * farther * farther;
    if (!is_dsa)
        kerma_ugy = fmin(kerma_ugy, 1000 * most_rate_mgy_min / (60 * rate));
    double per_mas = xray_output_ugy_mas(kv, XRAY_REFERENCE_MM), most_mas = 1000 * most_kw / kv * width / 1000;
    double mas = fmin(kerma_ugy / per_mas, most_mas), side = field * XRAY_REFERENCE_MM / XRAY_SOURCE_MM;
    XrayExposure e = {.kv = kv, .ma = mas / width * 1000, .width_ms = width, .kerma_mgy = mas * per_mas / 1000};
    e.kerma_area_gy_cm2 = e.kerma_mgy / 1000 * side * side / 100 * open_part(xray->collimator);
    e.rate_mgy_min = e.kerma_mgy * 60 * rate;
    return e;
}

XrayControl xray_second_plane(const XrayControl *xray)
{
    XrayControl second = *xray;
    second.lao_deg += second.lao_deg > 0 ? -90.0F : 90.0F;
    second.cra_deg = 0;
    return second;
}

int64_t dose_meter_step(DoseMeter *meter, const XrayPatient *patient, const XrayControl *xray, double seconds)
{
    bool pedal = xray->pedal > 0.5F;
    int64_t pulses = 0;
    const bool is_biplane = (int)xray->seen & SEEN_BIPLANE;
    if (pedal) {
        double rate = fmin(fmax((double)xray->pulses_s, 0), 1000), field = (double)xray->field_mm;
        meter->fluoroscopy_s += seconds;
        meter->phase = meter->had_pedal ? meter->phase + rate * seconds : 1;
        pulses = (int64_t)(meter->phase + 1e-9);
        meter->phase -= (double)pulses;
        meter->pulses += pulses;
        meter->area_cm2 += (is_biplane ? 2.0 : 1.0) * (double)pulses * field * field * open_part(xray->collimator) / 100;
    }
    if (pulses > 0) {
        const XrayControl plane = xray_second_plane(xray);
        meter->last = xray_expose(patient, xray);
        meter->second = is_biplane ? xray_expose(patient, &plane) : (XrayExposure){0};
        meter->second_kerma_mgy += (double)pulses * meter->second.kerma_mgy;
        meter->second_kerma_area_gy_cm2 += (double)pulses * meter->second.kerma_area_gy_cm2;
        meter->kerma_mgy += (double)pulses * (meter->last.kerma_mgy + meter->second.kerma_mgy);
        meter->kerma_area_gy_cm2 += (double)pulses * (meter->last.kerma_area_gy_cm2 + meter->second.kerma_area_gy_cm2);
        meter->kv_sum += (double)pulses * meter->last.kv;
        meter->ma_sum += (double)pulses * meter->last.ma;
    }
    meter->had_pedal = pedal;
    return pulses;
}
