// Vertebrae from the neck to the sacrum, with the hip bones.
#include "render/patient_body.h"

#define COUNT(array) ((int)(sizeof(array) / sizeof *(array)))

// [mm] lordosis of the neck, kyphosis of the chest, lordosis of the loin
const Vec3 vertebra_center[VERTEBRAE] = {
    {0, -22, -54},  {0, -24, -73},  {0, -25, -91},  {0, -26, -107}, {0, -28, -123}, {0, -31, -139}, {0, -36, -156}, {0, -43, -174}, {0, -51, -193},
    {0, -58, -213}, {0, -64, -233}, {0, -69, -254}, {0, -73, -275}, {0, -75, -297}, {0, -76, -320}, {0, -75, -343}, {0, -73, -366}, {0, -70, -391},
    {0, -66, -416}, {0, -61, -443}, {0, -56, -472}, {0, -52, -501}, {0, -51, -531}, {0, -54, -560}, {0, -65, -588},
};

static const Vec3 aside = {1, 0, 0};

static void tube(Body *body, Vec3 width, double hollow, double wall, double filling, int count, const Vec3 *point, double along, double across)
{
    TubeSize semi[8];
    for (int i = 0; i < count && i < COUNT(semi); i++)
        semi[i] = (TubeSize){along, across};
    body_add_tube(body, &(BodyTube){.width = width, .hollow = hollow, .wall = wall, .filling = filling}, count, point, semi);
}

static void solid(Body *body, Vec3 center, Vec3 semi, double attenuation)
{
    body_add_ellipsoid(body, &(BodyEllipsoid){.center = center, .semi = semi, .attenuation = attenuation});
}

// Sizes [mm] of a vertebra: half width and depth of its body, half the distance to the next, half the distance of the pedicles, reach of the processes.
typedef struct Vertebra {
    Vec3 center, up, back;   // unit directions
    double wide, deep, half, pedicle, transverse, spinous, droop;
} Vertebra;

static Vertebra vertebra_of(int k)
{
    Vertebra v = {.center = vertebra_center[k]};
    Vec3 above = vertebra_center[k > 0 ? k - 1 : 0], below = vertebra_center[k + 1 < VERTEBRAE ? k + 1 : k];
    v.up = vec3_unit(vec3_sub(above, below));
    v.back = vec3_cross(v.up, aside);
    if (v.back.y > 0)
        v.back = vec3_negate(v.back);
    v.half = vec3_distance(above, below) / (k > 0 && k + 1 < VERTEBRAE ? 4 : 2);
    if (k < FIRST_THORACIC) {
        v.wide = 11 + 0.3 * k, v.deep = 8, v.pedicle = 13, v.transverse = 26, v.spinous = k == 1 ? 42 : 36 + 2.5 * k, v.droop = 0.25;
    } else if (k < FIRST_LUMBAR) {
        double t = (k - FIRST_THORACIC) / 11.0;
        v.wide = 14 + 6 * t, v.deep = 10 + 6 * t, v.pedicle = 10 + 4 * t, v.transverse = 34 - 8 * t, v.spinous = 58, v.droop = 0.8 - 0.5 * t;
    } else {
        v.wide = 23 + 0.5 * (k - FIRST_LUMBAR), v.deep = 17, v.pedicle = 14 + 0.8 * (k - FIRST_LUMBAR), v.transverse = 42, v.spinous = 66, v.droop = 0.15;
    }
    return v;
}

static Vec3 place(const Vertebra *v, double right, double back, double up)
{
    return vec3_add_scaled(vec3_add_scaled(vec3_add(v->center, vec3(right, 0, 0)), back, v->back), up, v->up);
}

// The body with its plates; the discs are the gaps.
static void add_vertebral_body(Body *body, const Vertebra *v)
{
    double high = 0.8 * v->half;
    const Vec3 ends[] = {place(v, 0, 0, -high), place(v, 0, 0, high)};
    tube(body, aside, 0.9, 0.75 * ADDED_BONE, 1.1 * ADDED_SPONGY, 2, ends, v->wide, v->deep);
    for (int side = -1; side <= 1; side += 2) {
        const Vec3 plate[] = {place(v, 0, 0, side * high), place(v, 0, 0, side * (high - 1.1))};
        tube(body, aside, 0, 0.6 * ADDED_BONE, 0.6 * ADDED_BONE, 2, plate, v->wide, v->deep);
    }
}

static void add_arch(Body *body, const Vertebra *v)
{
    double d = v->deep, droop = v->droop, high = v->half;
    int first = body->count;
    const Vec3 pedicle[] = {place(v, v->pedicle, d - 1, 0.3 * high), place(v, v->pedicle + 1, d + 9, 0.3 * high)};
    tube(body, v->up, 0.65, ADDED_BONE, ADDED_SPONGY, 2, pedicle, 0.36 * high + 2, 0.25 * v->pedicle + 1);
    const Vec3 pillar[] = {place(v, v->pedicle + 3, d + 9, -0.95 * high), place(v, v->pedicle + 3, d + 7, 0.95 * high)};
    tube(body, aside, 0.7, 0.8 * ADDED_BONE, ADDED_SPONGY, 2, pillar, 5, 4.5);
    const Vec3 lamina[] = {place(v, v->pedicle, d + 11, 0), place(v, 0, d + 22, -0.3 * high)};
    tube(body, v->up, 0.6, 0.9 * ADDED_BONE, ADDED_SPONGY, 2, lamina, 0.65 * high, 2.6);
    const Vec3 process[] = {place(v, v->pedicle, d + 5, 0), place(v, v->transverse, d + 9, 0.05 * high)};
    tube(body, v->up, 0.6, 0.7 * ADDED_BONE, ADDED_SPONGY, 2, process, 4.2, 3);
    body_mirror(body, first);
    const Vec3 spine[] = {place(v, 0, d + 20, -0.3 * high), place(v, 0, v->spinous, -0.3 * high - droop * (v->spinous - d - 20))};
    tube(body, v->up, 0.6, 0.9 * ADDED_BONE, ADDED_SPONGY, 2, spine, 0.28 * high + 3, 2.8);
}

// Atlas, with the dens of the axis in it.
static void add_atlas(Body *body)
{
    const Vec3 dens[] = {{0, -23, -74}, {0, -22, -60}, {0, -21, -48}}, front[] = {{0, -12, -54}, {10, -14, -54}, {16, -19, -54}};
    const Vec3 behind[] = {{20, -31, -54}, {17, -46, -55}, {8, -58, -55}, {0, -61, -55}}, process[] = {{22, -24, -54}, {39, -26, -56}};
    const TubeSize size[3] = {{6, 5.5}, {5, 4.8}, {4, 3.5}};
    body_add_tube(body, &(BodyTube){.width = aside, .hollow = 0.7, .wall = ADDED_BONE, .filling = ADDED_SPONGY}, 3, dens, size);
    int first = body->count;
    const Vec3 up = {0, 0, 1};
    tube(body, up, 0.5, ADDED_BONE, ADDED_SPONGY, COUNT(front), front, 5, 2.5);
    tube(body, up, 0.5, ADDED_BONE, ADDED_SPONGY, COUNT(behind), behind, 4, 2.6);
    tube(body, up, 0.5, ADDED_BONE, ADDED_SPONGY, COUNT(process), process, 4.5, 3.5);
    solid(body, vec3(19, -25, -54), vec3(7.5, 9, 9), 0.8 * ADDED_BONE);
    solid(body, vec3(17, -28, -44), vec3(6, 9, 4), 0.5 * ADDED_BONE);     // condyle of the occiput
    body_mirror(body, first);
}

void body_add_neck(Body *body)
{
    add_atlas(body);
    for (int k = 1; k < FIRST_THORACIC; k++) {
        Vertebra v = vertebra_of(k);
        add_vertebral_body(body, &v);
        add_arch(body, &v);
    }
}

static void add_pelvis(Body *body)
{
    const Vec3 sacrum[] = {{0, -62, -576}, {0, -78, -606}, {0, -98, -640}, {0, -104, -670}};
    const TubeSize size[4] = {{52, 17}, {44, 14}, {28, 9}, {12, 5}};
    body_add_tube(body, &(BodyTube){.width = aside, .hollow = 0.9, .wall = 0.6 * ADDED_BONE, .filling = ADDED_SPONGY}, 4, sacrum, size);
    int first = body->count;
    for (int k = 0; k < 3; k++)
        solid(body, vec3(10.0 + 3 * k, -70 - 6.0 * k, -600 - 16.0 * k), vec3(3.5, 5, 3), -0.5 * ADDED_SPONGY);
    const Vec3 crest[] = {{48, -96, -598}, {64, -84, -566}, {92, -50, -548}, {122, -6, -562}, {130, 26, -592}};
    tube(body, vec3(0, 0, 1), 0.6, ADDED_BONE, ADDED_SPONGY, COUNT(crest), crest, 6, 5);
    body_add_ellipsoid(body, &(BodyEllipsoid){{96, -34, -598}, {3, 62, 46}, quat_from_rotation_vector(vec3(0, -0.35, -0.75)), 0.9 * ADDED_BONE});
    const Vec3 line[] = {{56, -74, -606}, {66, -40, -634}, {62, -4, -652}, {40, 24, -662}};
    tube(body, vec3(0, 0, 1), 0.6, ADDED_BONE, ADDED_SPONGY, COUNT(line), line, 9, 6);
    body_mirror(body, first);
}

void body_add_spine(Body *body)
{
    for (int k = FIRST_THORACIC; k + 1 < VERTEBRAE; k++) {
        Vertebra v = vertebra_of(k);
        add_vertebral_body(body, &v);
        add_arch(body, &v);
    }
    add_pelvis(body);
}
