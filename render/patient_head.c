// The skull. Landmarks in the body's frame [mm], from the sella: nasion (0, 67, 8), basion (0, -25, -39), porion (62, -18, -22), vertex (0, -20, 98).
#include "render/patient_body.h"

#define COUNT(array) ((int)(sizeof(array) / sizeof *(array)))

static BodyShape *solid(Body *body, Vec3 center, Vec3 semi, double attenuation)
{
    return body_add_ellipsoid(body, &(BodyEllipsoid){.center = center, .semi = semi, .attenuation = attenuation});
}

static BodyShape *turned_solid(Body *body, Vec3 center, Vec3 semi, Vec3 turn_deg, double attenuation)
{
    Quat turn = quat_from_rotation_vector(vec3_scale(turn_deg, PI / 180));
    return body_add_ellipsoid(body, &(BodyEllipsoid){center, semi, turn, attenuation});
}

// A cavity with a thin wall.
static void chamber(Body *body, Vec3 center, Vec3 semi, double thickness, double wall, double filling)
{
    solid(body, center, semi, wall);
    solid(body, center, vec3(semi.x - thickness, semi.y - thickness, semi.z - thickness), filling - wall);
}

static void rod(Body *body, Vec3 a, Vec3 b, double radius, double attenuation)
{
    const Vec3 point[2] = {a, b};
    const TubeSize semi[2] = {{radius, radius}, {radius, radius}};
    body_add_tube(body, &(BodyTube){.wall = attenuation, .filling = attenuation}, 2, point, semi);
}

static void even_tube(Body *body, const BodyTube *tube, int count, const Vec3 *point, double along, double across)
{
    TubeSize semi[32];
    for (int i = 0; i < count && i < COUNT(semi); i++)
        semi[i] = (TubeSize){along, across};
    body_add_tube(body, tube, count, point, semi);
}

static BodyTube plain_tube(Vec3 width, double attenuation) { return (BodyTube){.width = width, .wall = attenuation, .filling = attenuation}; }

// --- vault ---

static const Vec3 vault_center = {0, -19.5, 16}, vault_semi = {72, 92.5, 82};

// Below this plane, from the root of the nose to the occiput, there is the base.
static const Vec3 base_normal = {0, 0.1973, -0.9803};
static const double base_offset = 6.76;

// A point of the vault in the direction of `towards`, `depth` below its surface.
static Vec3 on_vault(Vec3 towards, double depth)
{
    Vec3 d = vec3_sub(towards, vault_center), u = {d.x / (vault_semi.x - depth), d.y / (vault_semi.y - depth), d.z / (vault_semi.z - depth)};
    return vec3_add_scaled(vault_center, 1 / vec3_norm(u), d);
}

static void add_vault(Body *body)
{
    // outer table, diploe, inner table; the inside is the brain
    const double depth[4] = {0, 1.8, 5.0, 6.2}, added[4] = {ADDED_BONE, ADDED_SPONGY - ADDED_BONE, ADDED_BONE - ADDED_SPONGY, -ADDED_BONE};
    for (int k = 0; k < 4; k++) {
        // thicker behind than in front
        Vec3 center = vec3_add(vault_center, vec3(0, k < 2 ? 0 : 0.8, 0));
        body_shape_clip(solid(body, center, vec3(vault_semi.x - depth[k], vault_semi.y - depth[k], vault_semi.z - depth[k]), added[k]), 0, base_normal,
                        base_offset);
    }
    // the squama of the occiput below it, with the foramen magnum
    const Vec3 bowl = {0, -50, -16};
    for (int k = 0; k < 2; k++) {
        BodyShape *shape = solid(body, bowl, k ? vec3(53, 45, 31) : vec3(56, 48.5, 34.5), k ? -0.7 * ADDED_BONE : 0.7 * ADDED_BONE);
        body_shape_clip(shape, 0, vec3_negate(base_normal), -base_offset);
        body_shape_clip(shape, 1, vec3(0, 1, 0), -30);
    }
    solid(body, vec3(0, -42, -49), vec3(14, 17, 4), -0.7 * ADDED_BONE);
    solid(body, vec3(0, -105, -4), vec3(9, 5, 8), 0.6 * ADDED_BONE);
}

// The marrow between the tables is uneven.
static void add_diploe(Body *body)
{
    Random random = {4711};
    int first = body->count;
    for (int i = 0; i < 140; i++) {
        Vec3 towards = vec3(random_within(&random, 2, 72), random_within(&random, -112, 70), random_within(&random, 0, 98));
        double size = random_within(&random, 2.5, 7), sign = random_within(&random, -1, 1);
        Vec3 at = on_vault(towards, 3.4);
        if (vec3_dot(base_normal, at) < base_offset - 6)
            solid(body, at, vec3(size, size, size), 0.006 * sign);
    }
    body_mirror(body, first);
}

// A seam through the vault along `key`, in zigzag.
static void add_suture(Body *body, int count, const Vec3 *key, double amplitude)
{
    enum { TEETH = 16 };
    for (int i = 0; i + 1 < count; i++) {
        int teeth = (int)fmin(fmax(vec3_distance(key[i], key[i + 1]) / 2.4, 2), TEETH);
        Vec3 last = on_vault(key[i], 2.6);
        for (int k = 1; k <= teeth; k++) {
            Vec3 at = on_vault(vec3_mix(key[i], key[i + 1], (double)k / teeth), 2.6), outward = vec3_unit(vec3_sub(at, vault_center));
            Vec3 aside = vec3_unit(vec3_cross(outward, vec3_sub(key[i + 1], key[i])));
            if (k < teeth)
                at = vec3_add_scaled(at, k % 2 ? amplitude : -amplitude, aside);
            const Vec3 piece[2] = {last, at};
            BodyTube seam = plain_tube(outward, 0.6 * (ATTENUATION_SOFT - ATTENUATION_BONE));
            even_tube(body, &seam, 2, piece, 2.6, 0.6);
            last = at;
        }
    }
}

void body_add_sagittal_suture(Body *body)
{
    const Vec3 key[] = {{0, 13, 97}, {0, -10, 99}, {0, -40, 96}, {0, -70, 84}, {0, -94, 64}};
    add_suture(body, COUNT(key), key, 1.3);
}

static void add_seams_and_grooves(Body *body)
{
    int first = body->count;
    const Vec3 coronal[] = {{1.5, 16, 97}, {20, 18, 92}, {40, 20, 76}, {58, 22, 46}, {66, 26, 10}};
    const Vec3 lambdoid[] = {{1.5, -94, 64}, {22, -93, 48}, {42, -84, 22}, {56, -70, -6}};
    const Vec3 squamous[] = {{68, 24, 8}, {72, 8, 24}, {72, -14, 26}, {70, -34, 14}, {66, -46, -4}};
    add_suture(body, COUNT(coronal), coronal, 1.1);
    add_suture(body, COUNT(lambdoid), lambdoid, 1.5);
    add_suture(body, COUNT(squamous), squamous, 0.3);
    // the middle meningeal artery
    const Vec3 front[] = {{60, 22, -4}, {66, 16, 14}, {66, 6, 40}, {56, -6, 68}, {36, -16, 86}, {16, -22, 95}};
    const Vec3 back[] = {{66, 16, 14}, {69, -16, 32}, {65, -50, 46}, {50, -78, 54}};
    Vec3 groove[6];
    BodyTube tube = plain_tube(vec3(0, 0, 0), -0.6 * ADDED_BONE);
    for (int i = 0; i < COUNT(front); i++)
        groove[i] = on_vault(front[i], 5.6);
    even_tube(body, &tube, COUNT(front), groove, 0.8, 0.8);
    for (int i = 0; i < COUNT(back); i++)
        groove[i] = on_vault(back[i], 5.6);
    even_tube(body, &tube, COUNT(back), groove, 0.7, 0.7);
    body_mirror(body, first);
}

// --- base ---

static void add_sella(Body *body)
{
    const Vec3 aside = {1, 0, 0};
    const Vec3 cup[] = {{0, 9, 3}, {0, 6.5, -2.5}, {0, 3, -6}, {0, -2.5, -6.5}, {0, -6.5, -3}, {0, -8.5, 5}};
    BodyTube plate = plain_tube(aside, 0.9 * ADDED_BONE);
    even_tube(body, &plate, COUNT(cup), cup, 7.5, 0.8);
    const Vec3 clivus[] = {{0, -11, -1}, {0, -17, -18}, {0, -25, -39}};
    even_tube(body, &(BodyTube){.width = aside, .hollow = 0.7, .wall = ADDED_BONE, .filling = ADDED_SPONGY}, COUNT(clivus), clivus, 12, 4.5);
    const Vec3 planum[] = {{0, 56, 1}, {0, 34, 4}, {0, 9, 3.6}};
    const TubeSize width[3] = {{5, 0.8}, {9, 0.8}, {13, 0.9}};
    body_add_tube(body, &plate, COUNT(planum), planum, width);
    solid(body, vec3(0, 51, 8), vec3(1.3, 7, 8), 0.8 * ADDED_BONE);
    int first = body->count;
    const Vec3 front[] = {{15, 15, 6}, {11, 4, 5}}, behind[] = {{0, -8.5, 5}, {7.5, -7.5, 6.5}};
    const Vec3 wing[] = {{13, 13, 6}, {28, 21, 9}, {44, 26, 11}, {58, 27, 12}};
    BodyTube bone = plain_tube(vec3(0, 0, 0), 0.9 * ADDED_BONE);
    body_add_tube(body, &bone, 2, front, (const TubeSize[]){{2.6, 2.6}, {1.3, 1.3}});
    body_add_tube(body, &bone, 2, behind, (const TubeSize[]){{1.5, 1.5}, {1.5, 1.5}});
    body_add_tube(body, &bone, COUNT(wing), wing, (const TubeSize[]){{2.4, 2.4}, {1.8, 1.8}, {1.5, 1.5}, {1.2, 1.2}});
    chamber(body, vec3(7, 17, -13), vec3(7, 13, 9), 0.8, 0.7 * ADDED_BONE, ADDED_AIR);
    body_mirror(body, first);
}

// The roof and floor of the middle cranial fossa, and the greater wing, which is the oblique line through the orbit from the front.
static void add_middle_fossa(Body *body)
{
    for (int k = 0; k < 2; k++) {
        BodyShape *shape =
            turned_solid(body, vec3(38, 6, 2), k ? vec3(23.4, 26, 24.5) : vec3(25, 27.5, 26), vec3(0, 0, -12), k ? -0.8 * ADDED_BONE : 0.8 * ADDED_BONE);
        body_shape_clip(shape, 0, vec3(0, 0, 1), -2);
    }
    const Vec3 line[] = {{52, 30, 8}, {46, 30, -6}, {40, 26, -20}};
    BodyTube plate = plain_tube(vec3(0, 1, 0), 0.8 * ADDED_BONE);
    even_tube(body, &plate, COUNT(line), line, 7, 0.9);
}

static void add_temporal_bone(Body *body)
{
    const Vec3 pyramid[] = {{11, -12, -15}, {28, -23, -17}, {45, -34, -19}, {58, -42, -22}};
    const TubeSize size[4] = {{5, 5}, {8, 8}, {11, 10}, {12, 10}};
    body_add_tube(body, &(BodyTube){.width = {0, 0, 1}, .hollow = 0.8, .wall = ADDED_BONE, .filling = 0.15 * ADDED_BONE}, COUNT(pyramid), pyramid, size);
    const Vec3 ridge[] = {{12, -12, -9}, {28, -22, -8}, {45, -33, -7.5}, {58, -41, -10}};
    BodyTube crest = plain_tube(vec3(0, 0, 0), ADDED_BONE);
    even_tube(body, &crest, COUNT(ridge), ridge, 1.5, 1.5);
    // labyrinth and cochlea: the densest bone of the body; the internal and external canals
    solid(body, vec3(36, -28, -15), vec3(5, 5, 5), ADDED_BONE);
    solid(body, vec3(29, -20, -18), vec3(4, 4, 4), 0.8 * ADDED_BONE);
    rod(body, vec3(19, -21, -14), vec3(31, -23, -14), 2.6, -1.1 * ADDED_BONE);
    rod(body, vec3(40, -18, -21), vec3(66, -18, -22), 3.4, ADDED_AIR);
    solid(body, vec3(39, -19, -20), vec3(3, 5, 6), ADDED_AIR - 0.3 * ADDED_BONE);
    // the mastoid and its cells
    solid(body, vec3(55, -40, -32), vec3(9, 13, 19), 0.2 * ADDED_BONE);
    Random random = {815};
    int cells = body->count;
    for (int i = 0; i < 160; i++) {
        Vec3 u = vec3(random_within(&random, -1, 1), random_within(&random, -1, 1), random_within(&random, -1, 1));
        Vec3 at = vec3(55 + 6.5 * u.x, -40 + 10.5 * u.y, -30 + 15 * u.z);
        double radius = random_within(&random, 1.2, 3);
        bool is_free = vec3_norm(u) < 1;
        for (int k = cells; k < body->count; k++)
            is_free &= vec3_distance(at, body->shape[k].center) > radius + body->shape[k].reach[0].x;
        if (is_free)
            solid(body, at, vec3(radius, radius, radius), 0.9 * ADDED_AIR);
    }
}

// --- face ---

static void add_orbit(Body *body)
{
    const Vec3 middle = {29, 37, -8}, turn = {0, 0, 20};
    for (int k = 0; k < 2; k++) {
        BodyShape *shape = turned_solid(body, middle, k ? vec3(18.3, 33, 16.3) : vec3(19.5, 34.5, 17.5), turn,
                                        k ? ATTENUATION_FAT - ATTENUATION_SOFT - 0.7 * ADDED_BONE : 0.7 * ADDED_BONE);
        body_shape_clip(shape, 0, vec3(0.30, 0.954, 0), 64);
    }
    enum { AROUND = 24 };
    Vec3 rim[AROUND];
    for (int i = 0; i < AROUND; i++) {
        // a rounded square that recedes to the side
        double a = 2 * PI * i / AROUND, c = cos(a), s = sin(a), round = pow(pow(fabs(c), 3) + pow(fabs(s), 3), -1.0 / 3);
        rim[i] = vec3(33 + 20 * round * c - 1.5 * s, 58 - 6.5 * c + 2 * s, -8 + 18 * round * s - 2 * c);
    }
    BodyTube ring = {.width = {0, 1, 0}, .wall = 0.75 * ADDED_BONE, .filling = 0.75 * ADDED_BONE, .is_closed = true};
    even_tube(body, &ring, AROUND, rim, 3.2, 2.3);
}

static void add_zygoma(Body *body)
{
    solid(body, vec3(47, 47, -27), vec3(9, 7, 9), 0.5 * ADDED_BONE);
    const Vec3 arch[] = {{50, 46, -27}, {61, 34, -25}, {67, 16, -24}, {67, 0, -22}, {62, -12, -19}};
    even_tube(body, &(BodyTube){.width = {0, 0, 1}, .hollow = 0.6, .wall = ADDED_BONE, .filling = ADDED_SPONGY}, COUNT(arch), arch, 4, 2);
}

static void add_sinuses(Body *body)
{
    chamber(body, vec3(28, 42, -38), vec3(14, 17, 16), 1, 0.7 * ADDED_BONE, ADDED_AIR);
    chamber(body, vec3(8, 64, 20), vec3(8, 5, 12), 0.8, 0.6 * ADDED_BONE, ADDED_AIR);
    chamber(body, vec3(19, 62, 23), vec3(7, 4.5, 8), 0.8, 0.6 * ADDED_BONE, ADDED_AIR);
    for (int i = 0; i < 5; i++)
        for (int k = 0; k < 2; k++)
            chamber(body, vec3(8 + 0.4 * k, 24 + 6.5 * i, -5 - 8.0 * k), vec3(4.4, 3.8, 4.4), 0.4, 0.5 * ADDED_BONE, ADDED_AIR);
    // the nose on both sides of its septum, with turbinates
    solid(body, vec3(6, 44, -32), vec3(4.5, 27, 15), 0.9 * ADDED_AIR);
    solid(body, vec3(7, 42, -39), vec3(2.4, 18, 4), -0.8 * ADDED_AIR);
    solid(body, vec3(7, 40, -29), vec3(2, 15, 3), -0.8 * ADDED_AIR);
}

static void add_middle_face(Body *body)
{
    const Vec3 bridge[] = {{2, 68, 8}, {2.5, 73, -4}, {2.5, 80, -17}}, palate[] = {{0, 70, -47}, {0, 44, -48}, {0, 20, -46}};
    const Vec3 septum[] = {{0, 66, -44}, {0, 50, -18}, {0, 36, -4}};
    BodyTube thin = plain_tube(vec3(1, 0, 0), 0.6 * ADDED_BONE);
    int first = body->count;
    body_add_tube(body, &thin, COUNT(bridge), bridge, (const TubeSize[]){{2.4, 2.5}, {2.4, 1.4}, {2, 0.7}});
    // pterygoid plates, and the back wall of the maxilla
    solid(body, vec3(13, 17, -36), vec3(1.3, 8, 14), 0.7 * ADDED_BONE);
    solid(body, vec3(19, 16, -36), vec3(1, 8, 13), 0.7 * ADDED_BONE);
    body_mirror(body, first);
    body_add_tube(body, &thin, COUNT(palate), palate, (const TubeSize[]){{10, 3}, {17, 1.6}, {15, 1.2}});
    even_tube(body, &thin, COUNT(septum), septum, 0.7, 10);
}

void body_add_skull(Body *body)
{
    add_vault(body);
    add_diploe(body);
    add_seams_and_grooves(body);
    add_sella(body);
    add_middle_face(body);
    int first = body->count;
    add_middle_fossa(body);
    add_temporal_bone(body);
    add_orbit(body);
    add_zygoma(body);
    add_sinuses(body);
    body_mirror(body, first);
}

// --- jaws ---

// One side of the row of teeth, from the middle.
static const double tooth_x[8] = {4.2, 11.5, 18, 22.6, 26, 28.8, 31, 32.6}, tooth_y[8] = {71, 68.5, 63.5, 57, 50, 41.5, 31.5, 22};
static const double tooth_half[8] = {3.8, 3.2, 3.5, 3.3, 3.3, 4.8, 4.7, 4.2};

static void add_tooth(Body *body, int k, bool is_upper)
{
    double up = is_upper ? 1 : -1, bite = -67.5 + 1.2 * up, wide = tooth_half[k], root = k == 2 ? 18 : 14, x = tooth_x[k] * (is_upper ? 1 : 0.95);
    double y = tooth_y[k] - (is_upper ? 0 : 3);
    Vec3 inward = vec3_unit(vec3(-x, 20 - y, 0)), aside = vec3_unit(vec3_cross(vec3(0, 0, 1), inward));
    const Vec3 crown[] = {{x, y, bite}, {x, y, bite + 3 * up}, {x, y, bite + 7.5 * up}};
    BodyTube enamel = plain_tube(aside, ADDED_TOOTH), dentine = {.width = aside, .hollow = 0.3, .wall = 0.8 * ADDED_BONE, .filling = 0};
    double deep = k < 3 ? 0.8 * wide : 1.05 * wide;
    body_add_tube(body, &enamel, 3, crown, (const TubeSize[]){{0.8 * wide, k < 3 ? 1 : 0.8 * deep}, {wide, deep}, {0.85 * wide, 0.85 * deep}});
    for (int side = k < 5 ? 0 : -1; side <= (k < 5 ? 0 : 1); side += 2) {
        Vec3 neck = vec3_add_scaled(crown[2], 0.45 * wide * side, aside), tip = vec3_add_scaled(neck, 0.4 * side, aside);
        double thin = side ? 0.42 * wide : 0.8 * wide;
        tip = vec3_add(tip, vec3(0.05 * root * inward.x, 0.15 * root * inward.y, root * up));
        const Vec3 path[] = {neck, vec3_mix(neck, tip, 0.6), tip};
        body_add_tube(body, &dentine, 3, path, (const TubeSize[]){{thin, 0.8 * deep}, {0.8 * thin, 0.6 * deep}, {0.3 * thin, 0.3 * deep}});
    }
}

static void add_mandible(Body *body)
{
    const Vec3 basal[] = {{0, 62, -96}, {12, 60, -95}, {23, 50, -92}, {33, 32, -87}, {42, 12, -80}, {47, -2, -72}};
    const Vec3 ramus[] = {{46, 0, -80}, {48, -1, -62}, {49, -2, -44}, {50, -6, -33}};
    const Vec3 condyle[] = {{50, -7, -36}, {50, -9, -24}}, coronoid[] = {{48, 8, -56}, {47, 14, -40}, {47, 17, -29}},
               canal[] = {{48, 2, -54}, {43, 10, -76}, {33, 32, -86}, {25, 46, -89}};
    BodyTube bone = {.width = {0, 0, 1}, .hollow = 0.72, .wall = 0.95 * ADDED_BONE, .filling = 1.6 * ADDED_SPONGY};
    body_add_tube(body, &bone, COUNT(basal), basal, (const TubeSize[]){{14, 7}, {13.5, 6.5}, {12.5, 6}, {12, 6}, {12, 5.5}, {11, 4}});
    bone.width = vec3(0, 1, 0);
    body_add_tube(body, &bone, COUNT(ramus), ramus, (const TubeSize[]){{16, 4}, {16, 3.4}, {13, 3}, {8, 3}});
    body_add_tube(body, &bone, COUNT(condyle), condyle, (const TubeSize[]){{4, 5}, {4.5, 8}});
    body_add_tube(body, &bone, COUNT(coronoid), coronoid, (const TubeSize[]){{6, 2}, {5, 2}, {1.5, 1.5}});
    BodyTube nerve = plain_tube(vec3(0, 0, 0), -1.2 * ADDED_SPONGY);
    even_tube(body, &nerve, COUNT(canal), canal, 1.6, 1.6);
    // sockets: the upper jaw's ridge below the palate
    const Vec3 ridge[] = {{0, 68, -53}, {11, 65, -53}, {21, 56, -53}, {28, 42, -52}, {31, 24, -50}};
    BodyTube spongy = {.width = {0, 0, 1}, .hollow = 0.8, .wall = 0.5 * ADDED_BONE, .filling = 1.5 * ADDED_SPONGY};
    even_tube(body, &spongy, COUNT(ridge), ridge, 8, 5.5);
}

void body_add_jaws(Body *body)
{
    int first = body->count;
    add_mandible(body);
    for (int k = 0; k < 8; k++) {
        add_tooth(body, k, true);
        add_tooth(body, k, false);
    }
    const Vec3 hyoid[] = {{0, 26, -122}, {10, 24, -121}, {18, 12, -117}, {22, -2, -112}};
    even_tube(body, &(BodyTube){.width = {0, 0, 1}, .hollow = 0.6, .wall = ADDED_BONE, .filling = ADDED_SPONGY}, COUNT(hyoid), hyoid, 3.4, 1.8);
    body_mirror(body, first);
}

// --- soft tissue ---

// Solids that touch at planes, so that none counts twice.
void body_add_head_tissue(Body *body)
{
    const double soft = ATTENUATION_SOFT, chin_offset = 104.9;
    const Vec3 under_chin = {0, -0.134, -0.991};
    body_shape_clip(solid(body, vec3(0, -19.5, 16), vec3(78, 100, 89), soft), 0, vec3(0, 0, -1), 20);
    BodyShape *face = solid(body, vec3(0, -17, -20), vec3(71.5, 91.5, 142), soft);
    body_shape_clip(face, 0, vec3(0, 0, 1), -20);
    body_shape_clip(face, 1, under_chin, chin_offset);
    const Vec3 neck[] = {{0, -25, -70}, {0, -27, -112}, {0, -31, -150}};
    const TubeSize size[3] = {{57, 58}, {56, 58}, {58, 60}};
    int first = body->count;
    BodyTube tube = plain_tube(vec3(1, 0, 0), soft);
    body_add_tube(body, &tube, COUNT(neck), neck, size);
    // the neck begins where the face ends
    if (!body->is_out_of_memory)
        body_shape_clip(&body->shape[first], 0, vec3_negate(under_chin), -chin_offset);
    // nose, lips and chin before the face
    body_shape_clip(turned_solid(body, vec3(0, 74, -22), vec3(13, 17, 20), vec3(-18, 0, 0), soft), 0, vec3(0, -1, 0), -74);
    body_shape_clip(solid(body, vec3(0, 62, -66), vec3(24, 19, 17), soft), 0, vec3(0, -1, 0), -71);
    body_shape_clip(solid(body, vec3(0, 56, -98), vec3(24, 19, 15), soft), 0, vec3(0, -1, 0), -58);
    // pharynx, larynx and trachea are full of air; the mouth is closed
    const Vec3 airway[] = {{0, 8, -40}, {0, 3, -62}, {0, 1, -90}, {0, 2, -118}, {0, 4, -140}, {0, -4, -165}};
    BodyTube air = plain_tube(vec3(1, 0, 0), ADDED_AIR);
    body_add_tube(body, &air, COUNT(airway), airway, (const TubeSize[]){{12, 8}, {12, 6}, {11, 7}, {12, 8}, {7, 8}, {9, 8}});
}
