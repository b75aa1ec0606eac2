// Dose as an angiography system shows it (IEC 60601-2-43): tube voltage and current, reference air kerma and its rate, dose-area product.
//
// Definitions. The patient entrance reference point of an isocentric C-arm lies on the reference axis, 150 mm from the isocentre towards the focal spot. The
// reference air kerma is that of the primary beam there, free in air, without scatter from the patient. The dose-area product (air kerma-area product) is the
// air kerma times the beam's area; by the inverse square law it is the same at any distance from the focal spot.
//
// Tube. Output [uGy/mAs] at 40 inches: 0.008373 kV^1.983, a fit to measurements of 40 radiographic units (imablog.net, "Radiation output from radiographic
// units", 2015); it falls with the inverse square of the distance.
// Automatic exposure. The patient is an ellipsoid of water in whose middle the isocentre lies: a head or a trunk, as large as those that fluoroscopy draws. The
// voltage rises with the thickness along the reference axis. The thickness transmits exp(-mu d), mu from NIST's tables (Hubbell and Seltzer, 1995) at 0.7
// of the peak energy, which stands for the filtered and hardened spectrum; couch and grid transmit two thirds. The current is then chosen so that each pulse has
// its air kerma at the detector: 0.03 uGy for a field of 220 mm there, and inversely proportional to the side of the field, as systems do when they magnify; 16
// times as much for DSA. In fluoroscopy the rate stays below 88 mGy/min at the reference point (21 CFR 1020.32), in all modes below 80 kW. Voltage curve, couch,
// detector's air kerma and pulse widths are assumptions in the usual range; no real system was measured.
#ifndef SELDINGER_SIM_XRAY_TUBE_H
#define SELDINGER_SIM_XRAY_TUBE_H

#include "geom/geom.h"
#include "sim/xray.h"

#include <stdbool.h>
#include <stdint.h>

#define XRAY_SOURCE_MM 785.0             // focal spot to isocentre, as in common angiography systems
#define XRAY_DETECTOR_MM 1100.0          // focal spot to detector
#define XRAY_REFERENCE_MM 635.0          // focal spot to the patient entrance reference point
#define XRAY_DSA_DOSE 16.0               // dose of a pulse of DSA in pulses of fluoroscopy

typedef struct XrayPatient {
    double half_mm[3];                   // semi-axes: to the side, to the front, to the head
    double water;                        // thickness of water that attenuates as much as 1 mm of the patient
} XrayPatient;

XrayPatient xray_patient_head(void);
XrayPatient xray_patient_trunk(void);
// A head if the tree's extents along the patient's axes fit into one, else a trunk. Zero axes: those of LPS. NULL: a head.
XrayPatient xray_patient_around(const VesselTree *tree, Vec3 anterior, Vec3 superior);
// [mm] of water along the reference axis.
double xray_patient_water_mm(const XrayPatient *patient, double lao_deg, double cra_deg);

typedef struct XrayExposure {            // of one pulse
    double kv, ma, width_ms;
    double kerma_mgy;                    // reference air kerma
    double kerma_area_gy_cm2;
    double rate_mgy_min;                 // reference air kerma rate at the pulse rate set
} XrayExposure;

// The settings of the second plane: 90 degrees from the first in LAO or RAO, level, the same field and blades.
XrayControl xray_second_plane(const XrayControl *xray);
double xray_output_ugy_mas(double kv, double distance_mm);     // of the tube, free in air
XrayExposure xray_expose(const XrayPatient *patient, const XrayControl *xray);

// Pulses and dose of a session. Biplane has two tubes, each with its own exposure and its own reference point; the patient gets the sum.
typedef struct DoseMeter {
    double phase;                        // of the next pulse; 1: due now
    bool had_pedal;
    int64_t pulses;
    double fluoroscopy_s;                // pedal down
    double area_cm2;                     // pulses times the open area at the isocentre, of both planes
    double kerma_mgy, kerma_area_gy_cm2; // of all pulses of both planes …
    double second_kerma_mgy, second_kerma_area_gy_cm2;   // … and the second plane's part
    double kv_sum, ma_sum;               // over pulses
    XrayExposure last, second;           // of the last pulse, in the second plane too if it is on; zeros before
} DoseMeter;

// A step of `seconds`; returns its number of pulses. The first pulse comes with the pedal.
int64_t dose_meter_step(DoseMeter *meter, const XrayPatient *patient, const XrayControl *xray, double seconds);

#endif
