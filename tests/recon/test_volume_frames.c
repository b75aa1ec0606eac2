// Oblique, anisotropic and left-handed grids: in every file format the same point in space has the same brightness, and the same vessel gives the same tree.
#include "recon/track/ransac_cylinder.h"
#include "recon/track/rbt_track.h"
#include "recon/volume/bspline.h"
#include "recon/volume/volume_file.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include <zlib.h>

typedef struct Bytes {
    uint8_t byte[1 << 14];
    size_t length;
} Bytes;

typedef struct Grid {
    Vec3 origin, axis[3];
} Grid;

enum { NX = 9, NY = 8, NZ = 7, COUNT = NX * NY * NZ };

static Faults faults;
static char folder[64];

// Converts a quaternion (b, c, d) to axes by the definition in nifti1.h.
static const double qb = 0.3, qc = -0.2, qd = 0.45, pixdim[3] = {0.3, 0.4, 0.65};

static Grid grid_of(bool left_handed)
{
    double a = sqrt(1 - qb * qb - qc * qc - qd * qd), f = left_handed ? -1 : 1;
    Grid g = {{-4, 7, 11},
              {{a * a + qb * qb - qc * qc - qd * qd, 2 * (qb * qc + a * qd), 2 * (qb * qd - a * qc)},
               {2 * (qb * qc - a * qd), a * a + qc * qc - qb * qb - qd * qd, 2 * (qc * qd + a * qb)},
               {2 * (qb * qd + a * qc), 2 * (qc * qd - a * qb), a * a + qd * qd - qc * qc - qb * qb}}};
    for (int i = 0; i < 3; i++)
        g.axis[i] = vec3_scale(g.axis[i], i == 2 ? f * pixdim[i] : pixdim[i]);
    return g;
}

static Vec3 point_of(const Grid *g, double i, double j, double k)
{
    return vec3_add_scaled(vec3_add_scaled(vec3_add_scaled(g->origin, i, g->axis[0]), j, g->axis[1]), k, g->axis[2]);
}

// Cubic B-splines reproduce linear functions, so values between voxels are known too.
static double brightness(Vec3 x) { return 200 + 3 * x.x - 2 * x.y + 5 * x.z; }

static void put_text(Bytes *b, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    b->length += (size_t)vsnprintf((char *)b->byte + b->length, sizeof b->byte - b->length, format, arguments);
    va_end(arguments);
}

static void put_float(Bytes *b, double x, bool big)
{
    float f = (float)x;
    uint32_t bits;
    memcpy(&bits, &f, 4);
    for (int i = 0; i < 4; i++)
        b->byte[b->length++] = (uint8_t)(bits >> (8 * (big ? 3 - i : i)));
}

static void put_samples(Bytes *b, const Grid *g, bool big, double slope, double intercept)
{
    for (int n = 0; n < COUNT; n++)
        put_float(b, (brightness(point_of(g, n % NX, n / NX % NY, n / (NX * NY))) - intercept) / slope, big);
}

static void pack(Bytes *out, const Bytes *in, int window)
{
    z_stream stream = {.next_in = (Bytef *)(uintptr_t)in->byte,
                       .avail_in = (uInt)in->length,
                       .next_out = out->byte + out->length,
                       .avail_out = (uInt)(sizeof out->byte - out->length)};
    assert_int_equal(deflateInit2(&stream, 9, Z_DEFLATED, window, 8, Z_DEFAULT_STRATEGY), Z_OK);
    assert_int_equal(deflate(&stream, Z_FINISH), Z_STREAM_END);
    out->length += stream.total_out;
    deflateEnd(&stream);
}

static void write_file(const char *name, const Bytes *b)
{
    char path[256];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(b->byte, 1, b->length, file), b->length);
    fclose(file);
}

static void check(Volume *v, const Grid *g, const char *frame)
{
    if (!v)
        print_message("%s\n", faults.text[0]);
    assert_non_null(v);
    assert_string_equal(v->frame, frame);
    Random random = random_from_seed(5, 0);
    for (int n = 0; n < 200; n++) {
        Vec3 x = point_of(g, 1 + (NX - 3) * random_unit(&random), 1 + (NY - 3) * random_unit(&random), 1 + (NZ - 3) * random_unit(&random));
        assert_true(fabs((double)bspline_sample(v, volume_voxel_of(v, x)) - brightness(x)) < 1e-3);   // floats near 200, positions with 7 digits
    }
    volume_free(v);
}

static void check_bytes(const Bytes *b, const Grid *g, const char *frame)
{
    faults_clear(&faults);
    check(volume_parse(b->byte, b->length, "test", &faults), g, frame);
}

static void check_file(const char *name, const Grid *g, const char *frame)
{
    char path[256];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    faults_clear(&faults);
    check(volume_load(path, &faults), g, frame);
}

static void nrrd(void **state)
{
    (void)state;
    static const char *const spaces[][2] = {{"LPS", "LPS"},
                                            {"right-anterior-superior", "RAS"},
                                            {"left-anterior-superior", "LAS"},
                                            {"3D-right-handed", "3D-right-handed"},
                                            {"3D-left-handed", "3D-left-handed"}};
    static Bytes b;
    for (int left = 0; left < 2; left++)
        for (size_t s = 0; s < sizeof spaces / sizeof spaces[0]; s++) {
            Grid g = grid_of(left);
            const Vec3 *a = g.axis, o = g.origin;
            b.length = 0;
            put_text(&b,
                     "NRRD0004\ntype: float\ndimension: 3\nspace: %s\nsizes: %d %d %d\nspace directions: (%.9g,%.9g,%.9g) (%.9g,%.9g,%.9g) "
                     "(%.9g,%.9g,%.9g)\n"
                     "space origin: (%.9g,%.9g,%.9g)\nendian: %s\nencoding: raw\n\n",
                     spaces[s][0], NX, NY, NZ, a[0].x, a[0].y, a[0].z, a[1].x, a[1].y, a[1].z, a[2].x, a[2].y, a[2].z, o.x, o.y, o.z, left ? "big" : "little");
            put_samples(&b, &g, left, 1, 0);
            check_bytes(&b, &g, spaces[s][1]);
        }
}

static void metaimage(void **state)
{
    (void)state;
    static Bytes b, data, slice;
    for (int left = 0; left < 2; left++)
        for (int form = 0; form < 5; form++) {   // local, compressed, detached, a list of slices, a numbered pattern
            static const char *const place[] = {"LOCAL\n", "LOCAL\n", "f.raw\n", "LIST\n", "s%02d.raw 3 15 2\n"};
            Grid g = grid_of(left);
            b.length = data.length = 0;
            put_text(&b, "ObjectType = Image\nNDims = 3\nElementByteOrderMSB = %s\nCompressedData = %s\nTransformMatrix =", left ? "True" : "False",
                     form == 1 ? "True" : "False");
            for (int i = 0; i < 3; i++) {
                Vec3 d = vec3_unit(g.axis[i]);
                put_text(&b, " %.9g %.9g %.9g", d.x, d.y, d.z);
            }
            put_text(&b, "\nOffset = %.9g %.9g %.9g\nElementSpacing = %g %g %g\nDimSize = %d %d %d\nElementType = MET_FLOAT\nElementDataFile = %s", g.origin.x,
                     g.origin.y, g.origin.z, pixdim[0], pixdim[1], pixdim[2], NX, NY, NZ, place[form]);
            put_samples(&data, &g, left, 1, 0);
            for (int k = 0; form > 2 && k < NZ; k++) {
                char name[16];
                snprintf(name, sizeof name, "s%02d.raw", 3 + 2 * k);
                slice.length = data.length / NZ;
                memcpy(slice.byte, data.byte + (size_t)k * slice.length, slice.length);
                write_file(name, &slice);
                if (form == 3)
                    put_text(&b, "%s\n", name);
            }
            if (form == 0)
                put_samples(&b, &g, left, 1, 0);
            if (form == 1)
                pack(&b, &data, 15);
            if (form == 2)
                write_file("f.raw", &data);
            write_file("f.mhd", &b);
            check_file("f.mhd", &g, "");
        }
}

static void put_at(Bytes *b, size_t at, double x, bool is_float, bool big)
{
    Bytes one = {.length = 0};
    if (is_float) {
        put_float(&one, x, big);
        memcpy(b->byte + at, one.byte, 4);
    } else {
        unsigned bits = (unsigned)(int)x;
        b->byte[at + big] = (uint8_t)bits;
        b->byte[at + !big] = (uint8_t)(bits >> 8);
    }
}

static void nifti(void **state)
{
    (void)state;
    static Bytes b, data, packed;
    for (int form = 0; form < 16; form++) {
        bool big = form & 1, left = form & 2, by_sform = form & 4, pair = form & 8;
        Grid g = grid_of(left);
        double slope = by_sform ? 0.25 : 1, intercept = by_sform ? -7 : 0;
        memset(b.byte, 0, 352);
        b.length = pair ? 348 : 352;
        put_at(&b, big ? 2 : 0, 348, false, big);
        const double dim[8] = {3, NX, NY, NZ, 1, 1, 1, 1}, spacing[4] = {left ? -1 : 1, pixdim[0], pixdim[1], pixdim[2]};
        for (size_t i = 0; i < 8; i++)
            put_at(&b, 40 + 2 * i, dim[i], false, big);
        put_at(&b, 70, 16, false, big);
        put_at(&b, 72, 32, false, big);
        for (size_t i = 0; i < 4; i++)
            put_at(&b, 76 + 4 * i, spacing[i], true, big);
        put_at(&b, 108, pair ? 0 : 352, true, big);
        put_at(&b, 112, by_sform ? slope : 0, true, big);
        put_at(&b, 116, intercept, true, big);
        b.byte[123] = 2;
        put_at(&b, 252, 1, false, big);   // both are given: the sform takes precedence
        put_at(&b, 254, by_sform, false, big);
        const double q[6] = {by_sform ? 0.1 : qb, by_sform ? 0.2 : qc, by_sform ? 0 : qd, g.origin.x, g.origin.y, g.origin.z};
        for (size_t i = 0; i < 6; i++)
            put_at(&b, 256 + 4 * i, q[i], true, big);
        const double row[12] = {g.axis[0].x, g.axis[1].x, g.axis[2].x, g.origin.x,  g.axis[0].y, g.axis[1].y,
                                g.axis[2].y, g.origin.y,  g.axis[0].z, g.axis[1].z, g.axis[2].z, g.origin.z};
        for (size_t i = 0; i < 12; i++)
            put_at(&b, 280 + 4 * i, row[i], true, big);
        memcpy(b.byte + 344, pair ? "ni1" : "n+1", 4);
        data.length = packed.length = 0;
        put_samples(&data, &g, big, slope, intercept);
        if (pair) {
            write_file("p.hdr", &b);
            write_file("p.img", &data);
            check_file("p.hdr", &g, "RAS");
            check_file("p.img", &g, "RAS");
        } else {
            put_samples(&b, &g, big, slope, intercept);
            check_bytes(&b, &g, "RAS");
            pack(&packed, &b, 15 + 16);
            write_file("f.nii.gz", &packed);
            check_file("f.nii.gz", &g, "RAS");
        }
    }
}

// --- tracking ---

static const double bend = 12, lumen = 1.3;   // [mm] radius of the arc in the plane z = 0, from 0 to 150 degrees, and of the vessel

static double from_arc(Vec3 x)
{
    double angle = atan2(x.y, x.x), last = 150 * PI / 180;
    angle = angle < -PI / 2 ? last : fmax(0, fmin(last, angle));
    return vec3_distance(x, vec3(bend * cos(angle), bend * sin(angle), 0));
}

static VesselTree *track_on(const Vec3 axis[3])
{
    // a grid that contains the arc's box, for any axes
    const Vec3 low = {-14, -3, -4}, high = {15, 15, 4};
    Volume *probe = volume_create((int[3]){1, 1, 1}, vec3(0, 0, 0), axis);
    double least[3] = {1e9, 1e9, 1e9}, most[3] = {-1e9, -1e9, -1e9};
    for (int c = 0; c < 8; c++) {
        Vec3 at = volume_voxel_of(probe, vec3(c & 1 ? high.x : low.x, c & 2 ? high.y : low.y, c & 4 ? high.z : low.z));
        const double place[3] = {at.x, at.y, at.z};
        for (int i = 0; i < 3; i++)
            least[i] = fmin(least[i], place[i]), most[i] = fmax(most[i], place[i]);
    }
    int size[3];
    for (int i = 0; i < 3; i++)
        size[i] = (int)(most[i] - least[i]) + 1;
    Volume *v = volume_create(size, volume_point_of(probe, vec3(least[0], least[1], least[2])), axis);
    assert_non_null(v);
    v->maximum = 100;
    for (int k = 0; k < size[2]; k++)
        for (int j = 0; j < size[1]; j++)
            for (int i = 0; i < size[0]; i++)
                v->value[((size_t)k * (size_t)size[1] + (size_t)j) * (size_t)size[0] + (size_t)i] =
                    (float)(50 * erfc((from_arc(volume_point_of(v, vec3(i, j, k))) - lumen) / (sqrt(2.0) * 0.2)));
    RbtParameters parameters = rbt_default_parameters();
    RbtSeed seed = {.start = {bend * cos(0.2), bend * sin(0.2), 0}, .toward = {bend * cos(0.5), bend * sin(0.5), 0}, .has_toward = true, .radius = lumen};
    faults_clear(&faults);
    VesselTree *tree = rbt_track(v, &parameters, &seed, 1, NULL, 0, 1, NULL, NULL, "test", &faults);
    if (!tree)
        print_message("%s\n", faults.text[0]);
    assert_non_null(tree);
    volume_free(probe);
    volume_free(v);
    return tree;
}

typedef struct Figures {
    double centre, radius, radius_spread, reach;   // [mm] mean distance from the arc, mean radius, largest departure from it; [rad] last angle
} Figures;

static Figures figures_of(VesselTree *tree)
{
    Figures f = {0};
    for (int i = 0; i < tree->node_count; i++) {
        f.centre += from_arc(tree->center[i]) / tree->node_count;
        f.radius += tree->radius[i] / tree->node_count;
        f.reach = fmax(f.reach, atan2(tree->center[i].y, tree->center[i].x));
    }
    for (int i = 0; i < tree->node_count; i++)
        f.radius_spread = fmax(f.radius_spread, fabs(tree->radius[i] - f.radius));
    vessel_tree_free(tree);
    return f;
}

static void one_vessel_on_any_grid(void **state)
{
    (void)state;
    Grid turned = grid_of(false), left = grid_of(true);
    const double even = 0.4;
    Vec3 straight[3] = {{even, 0, 0}, {0, even, 0}, {0, 0, even}}, flat[3] = {{0.3, 0, 0}, {0, 0.3, 0}, {0, 0, 0.6}}, rotated[3], mirrored[3], sheared[3];
    for (int i = 0; i < 3; i++) {
        rotated[i] = vec3_scale(vec3_unit(turned.axis[i]), even);
        mirrored[i] = vec3_scale(vec3_unit(left.axis[i]), i == 2 ? 0.6 : 0.35);
        sheared[i] = straight[i];
    }
    sheared[2] = vec3(0.1, 0.05, even);
    const Vec3 *grids[] = {straight, rotated, flat, mirrored, sheared};
    static const char *const names[] = {"straight", "rotated", "anisotropic", "rotated, anisotropic, left-handed", "sheared"};
    Figures first = {0};
    for (int n = 0; n < 5; n++) {
        Figures f = figures_of(track_on(grids[n]));
        print_message("%s: centre %.3f mm, radius %.3f +- %.3f mm, to %.1f degrees\n", names[n], f.centre, f.radius, f.radius_spread, f.reach * 180 / PI);
        first = n ? first : f;
        // 0.15 voxel (mean edge 0.4 mm), and half as much between grids, as required of tracking on straight grids. A cylinder on a bent vessel is off its
        // axis by about height^2 / (24 bend) = 0.03 mm by itself
        assert_true(f.centre < 0.06 && fabs(f.radius - lumen) < 0.06 && fabs(f.radius - first.radius) < 0.03 && f.radius_spread < 0.15);
        assert_true(fabs(f.reach - 150 * PI / 180) < lumen / bend);   // all end at the arc's end, within a radius
    }
}

static int make_folder(void **state)
{
    (void)state;
    snprintf(folder, sizeof folder, "/tmp/test_frames_XXXXXX");
    return mkdtemp(folder) ? 0 : -1;
}

static int remove_folder(void **state)
{
    (void)state;
    static const char *names[] = {"f.mhd", "f.raw", "f.nii.gz", "p.hdr", "p.img", "s03.raw", "s05.raw", "s07.raw", "s09.raw", "s11.raw", "s13.raw", "s15.raw"};
    char path[256];
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
        snprintf(path, sizeof path, "%s/%s", folder, names[i]);
        remove(path);
    }
    return rmdir(folder);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(nrrd), cmocka_unit_test(metaimage), cmocka_unit_test(nifti), cmocka_unit_test(one_vessel_on_any_grid)};
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
