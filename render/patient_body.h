// A plain adult made of solids (render/body_shape.h): head, neck and trunk to the pelvis, arms aside. Sizes are means of textbooks of anatomy and of
// cephalometry (sella to nasion 68 mm, to basion 46 mm); it is meant to be recognised, not measured.
#ifndef SELDINGER_RENDER_PATIENT_BODY_H
#define SELDINGER_RENDER_PATIENT_BODY_H

#include "render/body_shape.h"

// Linear attenuation [1/mm] at 60 keV, about the mean energy behind a head at 80 kV: mass attenuation coefficients of NIST (Hubbell and Seltzer, NISTIR 5632,
// tables 3 and 4) times the densities of ICRU Report 44. Spongy bone: 1.18 g/cm3; lung: 0.26 g/cm3 inflated.
#define ATTENUATION_SOFT 0.0217
#define ATTENUATION_WATER 0.0206
#define ATTENUATION_FAT 0.0188
#define ATTENUATION_BONE 0.0604
#define ATTENUATION_SPONGY 0.0280
#define ATTENUATION_TOOTH 0.0900
#define ATTENUATION_LUNG 0.0053

// What a solid inside soft tissue adds to it.
#define ADDED_BONE (ATTENUATION_BONE - ATTENUATION_SOFT)
#define ADDED_SPONGY (ATTENUATION_SPONGY - ATTENUATION_SOFT)
#define ADDED_TOOTH (ATTENUATION_TOOTH - ATTENUATION_SOFT)
#define ADDED_AIR (-ATTENUATION_SOFT)

static inline double random_within(Random *random, double low, double high) { return low + (high - low) * random_unit(random); }

// Everything but the soft tissue and the sagittal suture is the same on both sides of the head.
void body_add_skull(Body *body);
void body_add_sagittal_suture(Body *body);
void body_add_jaws(Body *body);
void body_add_neck(Body *body);
void body_add_head_tissue(Body *body);
void body_add_spine(Body *body);           // below the neck, with pelvis
void body_add_rib_cage(Body *body);        // with scapulae, clavicles, sternum
void body_add_chest(Body *body);           // soft tissue, lungs with their vessels, heart, diaphragm
bool body_add_patient(Body *body);         // all of them; false if out of memory

// Vertebra C1 to C7, T1 to T12, L1 to L5, S1: 0 to 24.
enum { VERTEBRAE = 25, FIRST_THORACIC = 7, FIRST_LUMBAR = 19 };
extern const Vec3 vertebra_center[VERTEBRAE];   // of its body

#endif
