// Chest and abdomen: ribs, shoulder girdle, lungs, heart, diaphragm, soft tissue.
#include "render/patient_body.h"

#define COUNT(array) ((int)(sizeof(array) / sizeof *(array)))

static BodyShape *solid(Body *body, Vec3 center, Vec3 semi, double attenuation)
{
    return body_add_ellipsoid(body, &(BodyEllipsoid){.center = center, .semi = semi, .attenuation = attenuation});
}

static void even_tube(Body *body, const BodyTube *tube, int count, const Vec3 *point, double along, double across)
{
    TubeSize semi[32];
    for (int i = 0; i < count && i < COUNT(semi); i++)
        semi[i] = (TubeSize){along, across};
    body_add_tube(body, tube, count, point, semi);
}

static const BodyTube bone = {.hollow = 0.6, .wall = ADDED_BONE, .filling = ADDED_SPONGY};

static BodyTube bone_of(Vec3 width)
{
    BodyTube tube = bone;
    tube.width = width;
    return tube;
}

// --- bones ---

// Half an ellipse from the spine round the chest, sinking towards the front.
static void add_rib(Body *body, int number)
{
    //                              1   2   3    4    5    6    7    8    9    10   11   12
    static const double side[12] = {56, 84, 104, 117, 127, 133, 137, 138, 136, 131, 122, 106}, deep[12] = {36, 55, 69, 78, 84, 87, 88, 88, 87, 85, 82, 78};
    static const double sinks[12] = {38, 52, 62, 70, 77, 84, 92, 98, 102, 100, 90, 70},
                        ends_deg[12] = {155, 152, 150, 148, 146, 143, 138, 128, 118, 108, 84, 60};
    enum { PIECES = 16 };
    Vec3 point[PIECES + 1];
    Vec3 spine = vertebra_center[FIRST_THORACIC + number], root = vec3(0, spine.y - 17, spine.z + 8);
    int i = number;
    for (int k = 0; k <= PIECES; k++) {
        double a = (12 + (ends_deg[i] - 12) * k / PIECES) * PI / 180, back = 14 * sin(a) * sin(a) * fmax(cos(a), 0);
        point[k] = vec3(side[i] * pow(sin(a), 0.85), root.y + deep[i] * (1 - cos(a)) - back, root.z - sinks[i] * (1 - cos(a)) / 2);
    }
    double high = number == 0 ? 8 : number > 9 ? 5 : 6.5;
    // the first rib lies flat
    BodyTube rib = bone_of(number == 0 ? vec3(0.8, 0.6, 0) : vec3(0, 0, 1));
    rib.hollow = 0.5;
    rib.filling = 2 * ADDED_SPONGY;
    even_tube(body, &rib, PIECES + 1, point, high, 4);
}

static void add_shoulder(Body *body)
{
    const Vec3 clavicle[] = {{20, 2, -192}, {46, 4, -188}, {78, -8, -182}, {110, -34, -178}, {142, -40, -176}};
    BodyTube tube = bone_of(vec3(0, 0, 1));
    even_tube(body, &tube, COUNT(clavicle), clavicle, 6, 6);
    // scapula: a thin blade with thick borders and its spine
    Quat turn = quat_from_rotation_vector(vec3(0.08, 0.12, -0.62));
    BodyShape *blade = body_add_ellipsoid(body, &(BodyEllipsoid){{106, -112, -262}, {44, 1.5, 84}, turn, 0.8 * ADDED_BONE});
    body_shape_clip(blade, 0, vec3(0.86, 0, -0.5), 0.86 * 134 + 0.5 * 232);
    body_shape_clip(blade, 1, vec3(0, 0, 1), -190);
    const Vec3 lateral[] = {{144, -70, -222}, {134, -90, -262}, {114, -116, -308}, {104, -122, -330}};
    const Vec3 medial[] = {{104, -122, -330}, {82, -124, -292}, {74, -124, -248}, {82, -112, -204}};
    const Vec3 spine[] = {{76, -124, -238}, {108, -126, -218}, {140, -104, -196}, {158, -66, -188}};
    const Vec3 coracoid[] = {{136, -66, -206}, {138, -44, -196}, {144, -26, -206}};
    even_tube(body, &tube, COUNT(lateral), lateral, 4.5, 4.5);
    even_tube(body, &tube, COUNT(medial), medial, 2.2, 2.2);
    even_tube(body, &tube, COUNT(spine), spine, 5.5, 3);
    even_tube(body, &tube, COUNT(coracoid), coracoid, 5, 5);
    solid(body, vec3(146, -62, -216), vec3(6, 10, 18), 0.5 * ADDED_BONE);
    // head of the humerus, the arm raised aside
    BodyShape *head = solid(body, vec3(168, -56, -212), vec3(23, 23, 24), 0.55 * ADDED_BONE);
    body_shape_hollow(head, 0.93, 1.2 * ADDED_SPONGY);
    const Vec3 humerus[] = {{172, -56, -222}, {184, -54, -270}, {190, -52, -340}};
    body_add_tube(body, &bone, COUNT(humerus), humerus, (const TubeSize[]){{17, 17}, {12, 12}, {11, 11}});
}

static void add_sternum(Body *body)
{
    const Vec3 path[] = {{0, 6, -198}, {0, 26, -240}, {0, 46, -290}, {0, 60, -345}};
    const TubeSize size[4] = {{26, 7}, {18, 6}, {19, 5.5}, {15, 5}};
    BodyTube tube = bone_of(vec3(1, 0, 0));
    tube.hollow = 0.8;
    body_add_tube(body, &tube, COUNT(path), path, size);
}

void body_add_rib_cage(Body *body)
{
    add_sternum(body);
    int first = body->count;
    for (int i = 0; i < 12; i++)
        add_rib(body, i);
    add_shoulder(body);
    body_mirror(body, first);
}

// --- soft tissue ---

static const double aerated = ATTENUATION_LUNG - ATTENUATION_SOFT;   // what a lung takes from soft tissue
static const double floor_z[2] = {-405, -396};                       // of the left and right lung

// Branches of the lung's vessels, halved at each fork.
static void add_vessels(Body *body, Random *random, Vec3 from, Vec3 towards, double radius, double length, int left)
{
    Vec3 to = vec3_add_scaled(from, length, towards);
    const Vec3 path[] = {from, to};
    even_tube(body, &(BodyTube){.wall = -aerated, .filling = -aerated}, 2, path, radius, radius);
    for (int k = 0; left > 0 && k < 2; k++) {
        Vec3 aside = vec3(random_within(random, -1, 1), random_within(random, -1, 1), random_within(random, -1, 1));
        aside = vec3_unit(vec3_add_scaled(aside, -vec3_dot(aside, towards), towards));
        add_vessels(body, random, to, vec3_unit(vec3_add_scaled(towards, k ? 0.62 : -0.5, aside)), radius * 0.74, length * 0.82, left - 1);
    }
}

static void add_lung(Body *body, int side)
{
    double bottom = floor_z[side > 0];
    Vec3 center = {side * 75, -24, -335}, semi = {62, 88, 150};
    body_shape_clip(solid(body, center, semi, aerated), 0, vec3(0, 0, -1), -bottom);
    // the dome of the diaphragm
    double high = side > 0 ? 44 : 40;
    body_shape_clip(solid(body, vec3(side * 75, -24, bottom), vec3(54.5, 77, high), -aerated), 0, vec3(0, 0, -1), -bottom);
    Random random = {side > 0 ? 31 : 37};
    const Vec3 root = {side * 34, -30, side > 0 ? -286 : -278};
    const Vec3 way[] = {{0.35, 0.1, 0.93}, {0.75, 0.45, 0.4}, {0.8, -0.45, -0.1}, {0.6, 0.4, -0.7}, {0.35, -0.45, -0.82}};
    for (int k = 0; k < COUNT(way); k++)
        add_vessels(body, &random, root, vec3_unit(vec3(side * way[k].x, way[k].y, way[k].z)), 4.2, 24, 4);
    solid(body, vec3(side * 32, -30, root.z), vec3(11, 13, 18), -0.6 * aerated);    // hilum
}

// What of the heart and the great vessels lies in the lungs' shadow; between the lungs it is soft tissue like the rest.
static void add_heart(Body *body)
{
    Quat turn = quat_from_rotation_vector(vec3(0, 0.62, 0.35));
    BodyEllipsoid heart = {{-26, 14, -340}, {70, 48, 50}, turn, -aerated};
    body_shape_clip(body_add_ellipsoid(body, &heart), 0, vec3(1, 0, 0), -13);
    body_shape_clip(solid(body, vec3(14, 10, -330), vec3(36, 44, 52), -aerated), 0, vec3(-1, 0, 0), -13);
    body_shape_clip(solid(body, vec3(-24, -36, -248), vec3(17, 26, 17), -aerated), 0, vec3(1, 0, 0), -13);       // aortic knuckle
    body_shape_clip(solid(body, vec3(-22, 4, -285), vec3(20, 26, 22), -aerated), 0, vec3(1, 0, 0), -13);         // pulmonary trunk
    const Vec3 descending[] = {{-22, -50, -255}, {-26, -56, -310}, {-22, -52, -395}};
    BodyTube aorta = {.wall = -0.6 * aerated, .filling = -0.6 * aerated};
    even_tube(body, &aorta, COUNT(descending), descending, 12, 12);
    body_shape_clip(solid(body, vec3(20, 4, -250), vec3(15, 16, 60), -aerated), 0, vec3(-1, 0, 0), -13);         // superior vena cava
    // trachea and main bronchi
    const Vec3 trachea[] = {{0, -6, -168}, {0, -18, -205}, {1, -34, -262}}, right[] = {{1, -34, -260}, {20, -36, -280}, {34, -34, -292}},
               left[] = {{1, -34, -260}, {-26, -38, -280}, {-44, -36, -290}};
    BodyTube air = {.wall = ADDED_AIR, .filling = ADDED_AIR};
    even_tube(body, &air, COUNT(trachea), trachea, 8.5, 8.5);
    even_tube(body, &air, COUNT(right), right, 6.5, 6.5);
    even_tube(body, &air, COUNT(left), left, 5.5, 5.5);
}

static void add_trunk(Body *body)
{
    const double soft = ATTENUATION_SOFT;
    BodyShape *nape = solid(body, vec3(0, -33, -196), vec3(118, 70, 55), soft);
    body_shape_clip(nape, 0, vec3(0, 0, 1), -150);
    body_shape_clip(nape, 1, vec3(0, 0, -1), 186);
    BodyShape *shoulders = solid(body, vec3(0, -34, -246), vec3(196, 102, 74), soft);
    body_shape_clip(shoulders, 0, vec3(0, 0, 1), -186);
    body_shape_clip(shoulders, 1, vec3(0, 0, -1), 246);
    // [mm] z, y of the middle, half width, half depth: drawn in slices, so that the outline has no steps
    static const double key[][4] = {{-246, -34, 194, 102}, {-290, -31, 168, 106}, {-340, -30, 165, 110}, {-420, -28, 158, 110},
                                    {-520, -26, 150, 104}, {-610, -28, 168, 104}, {-720, -30, 172, 104}};
    enum { KEYS = COUNT(key), SLICES = 6, PIECES = (KEYS - 1) * SLICES };
    Vec3 axis[PIECES + 1];
    TubeSize size[PIECES + 1];
    for (int i = 0; i <= PIECES; i++) {
        const double *a = key[i < PIECES ? i / SLICES : KEYS - 2], *b = key[i < PIECES ? i / SLICES + 1 : KEYS - 1];
        double u = i < PIECES ? (double)(i % SLICES) / SLICES : 1;
        axis[i] = vec3(0, a[1] + u * (b[1] - a[1]), a[0] + u * (b[0] - a[0]));
        size[i] = (TubeSize){a[2] + u * (b[2] - a[2]), a[3] + u * (b[3] - a[3])};
    }
    body_add_tube(body, &(BodyTube){.width = {1, 0, 0}, .wall = soft, .filling = soft}, COUNT(axis), axis, size);
    // gas in the stomach and the colon
    solid(body, vec3(-62, 6, -420), vec3(26, 22, 16), ADDED_AIR);
    solid(body, vec3(92, 10, -520), vec3(20, 20, 26), 0.6 * ADDED_AIR);
    solid(body, vec3(-96, 0, -500), vec3(16, 18, 34), 0.6 * ADDED_AIR);
}

void body_add_chest(Body *body)
{
    add_trunk(body);
    add_lung(body, 1);
    add_lung(body, -1);
    add_heart(body);
}

bool body_add_patient(Body *body)
{
    body_add_head_tissue(body);
    body_add_skull(body);
    body_add_sagittal_suture(body);
    body_add_jaws(body);
    body_add_neck(body);
    body_add_chest(body);
    body_add_spine(body);
    body_add_rib_cage(body);
    return !body->is_out_of_memory;
}
