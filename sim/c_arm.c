// With theta = LAO, phi = CRA, and the patient's left L, anterior A, superior S:
//   towards = cos phi (cos theta A + sin theta L) + sin phi S,  right = cos theta L - sin theta A,  up = cos phi S - sin phi (cos theta A + sin theta L).
// A point at p from the isocentre is projected to (right . p, up . p) D / ((D + towards . p) field), D the distance from source to isocentre.
#include "sim/c_arm.h"

#include <stdio.h>

PatientAxes patient_axes_lps(void) { return (PatientAxes){{-1, 0, 0}, {0, -1, 0}, {0, 0, 1}}; }
PatientAxes patient_axes_ras(void) { return (PatientAxes){{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}; }

bool patient_axes_are_sound(const PatientAxes *axes)
{
    const Vec3 a[3] = {axes->right, axes->anterior, axes->superior};
    for (int i = 0; i < 3; i++)
        if (!(fabs(vec3_norm(a[i]) - 1) < 1e-6) || !(fabs(vec3_dot(a[i], a[(i + 1) % 3])) < 1e-6))
            return false;
    return true;
}

static double within(double value, double least, double most, double otherwise) { return isfinite(value) ? fmin(fmax(value, least), most) : otherwise; }

CArm c_arm_place(const XrayControl *xray, const PatientAxes *axes)
{
    XrayControl usual = xray_default_control();
    double theta = within(xray->lao_deg, -90, 90, 0) * PI / 180, phi = within(xray->cra_deg, -45, 45, 0) * PI / 180;
    Vec3 left = vec3_negate(axes->right);
    Vec3 level = vec3_add_scaled(vec3_scale(axes->anterior, same_cos(theta)), same_sin(theta), left);
    CArm c_arm = {
        .isocentre = {within(xray->table_mm[0], -1e6, 1e6, 0), within(xray->table_mm[1], -1e6, 1e6, 0), within(xray->table_mm[2], -1e6, 1e6, 0)},
        .right = vec3_add_scaled(vec3_scale(left, same_cos(theta)), -same_sin(theta), axes->anterior),
        .up = vec3_add_scaled(vec3_scale(axes->superior, same_cos(phi)), -same_sin(phi), level),
        .towards = vec3_add_scaled(vec3_scale(level, same_cos(phi)), same_sin(phi), axes->superior),
        .field_mm = within(xray->field_mm, 40, 400, usual.field_mm),
    };
    c_arm.handedness = vec3_dot(vec3_cross(c_arm.right, c_arm.up), c_arm.towards) < 0 ? -1 : 1;
    return c_arm;
}

Vec3 c_arm_project(const CArm *c_arm, Vec3 point)
{
    Vec3 p = vec3_sub(point, c_arm->isocentre);
    double depth = vec3_dot(c_arm->towards, p), scale = C_ARM_SOURCE_MM / ((C_ARM_SOURCE_MM + depth) * c_arm->field_mm);
    return vec3(vec3_dot(c_arm->right, p) * scale, vec3_dot(c_arm->up, p) * scale, depth);
}

Vec3 c_arm_source(const CArm *c_arm) { return vec3_add_scaled(c_arm->isocentre, -C_ARM_SOURCE_MM, c_arm->towards); }

Vec3 c_arm_ray(const CArm *c_arm, double x, double y)
{
    Vec3 d = vec3_add_scaled(vec3_scale(c_arm->towards, C_ARM_SOURCE_MM), x * c_arm->field_mm, c_arm->right);
    return vec3_unit(vec3_add_scaled(d, y * c_arm->field_mm, c_arm->up));
}

void c_arm_matrix(const CArm *c_arm, Vec3 origin, double near_mm, double far_mm, float matrix[16])
{
    // in half sides of the square at the isocentre; relative to `origin`, so that the numbers are small
    double zoom = 2 * C_ARM_SOURCE_MM / c_arm->field_mm;
    Vec3 shift = vec3_sub(origin, c_arm->isocentre);
    double a = (far_mm + near_mm) / (far_mm - near_mm), b = -2 * far_mm * near_mm / (far_mm - near_mm);
    double w = vec3_dot(c_arm->towards, shift) + C_ARM_SOURCE_MM;
    const Vec3 row[4] = {vec3_scale(c_arm->right, zoom), vec3_scale(c_arm->up, zoom), vec3_scale(c_arm->towards, a), c_arm->towards};
    const double last[4] = {zoom * vec3_dot(c_arm->right, shift), zoom * vec3_dot(c_arm->up, shift), a * w + b, w};
    for (int i = 0; i < 4; i++) {
        matrix[i] = (float)row[i].x;
        matrix[4 + i] = (float)row[i].y;
        matrix[8 + i] = (float)row[i].z;
        matrix[12 + i] = (float)last[i];
    }
}

void c_arm_label(const XrayControl *xray, char text[32])
{
    int lao = (int)lround(within(xray->lao_deg, -90, 90, 0)), cra = (int)lround(within(xray->cra_deg, -45, 45, 0));
    snprintf(text, 32, "%s %d  %s %d", lao < 0 ? "RAO" : "LAO", lao < 0 ? -lao : lao, cra < 0 ? "CAU" : "CRA", cra < 0 ? -cra : cra);
}
