#include "study/vessel_store.h"

#include "base/base.h"

#include <stdlib.h>
#include <string.h>

enum { UNUSED_MOST = 16, KEY = 65 };

typedef struct Kept {
    OpenVessel open;         // first: what is lent is found again by its address
    char key[KEY];
    int users;
    int64_t last;            // number of the call that used it last
    struct Kept *next;
} Kept;

struct VesselStore {
    pthread_mutex_t *files;
    Kept *first;
    int64_t calls;
};

VesselStore *vessel_store_create(pthread_mutex_t *files)
{
    VesselStore *store = HEAP_ZEROED(1, sizeof *store);
    store->files = files;
    return store;
}

static void add_text(Sha256 *sha, const char *text) { sha256_add(sha, text ? text : "", text ? strlen(text) + 1 : 1); }

// All that open_vessel() reads of a scene. Arrays of numbers have no padding; structures are added by their members.
static void make_key(const Scene *scene, char key[KEY])
{
    Sha256 sha;
    const TubeOptions *tube = &scene->tube;
    int whole[] = {(int)scene->source, (int)scene->contact, scene->shape_option_count, tube->piece_count,
                   tube->point_count,  tube->closed_ends,   scene->wire.has_sheath};
    double number[] = {tube->start.x,        tube->start.y,         tube->start.z,         tube->direction.x,     tube->direction.y,    tube->direction.z,
                       tube->normal.x,       tube->normal.y,        tube->normal.z,        tube->radius,          scene->plane_point.x, scene->plane_point.y,
                       scene->plane_point.z, scene->plane_normal.x, scene->plane_normal.y, scene->plane_normal.z, scene->mesh_scale,    scene->mesh_cell};
    sha256_begin(&sha);
    sha256_add(&sha, whole, sizeof whole);
    sha256_add(&sha, number, sizeof number);
    add_text(&sha, scene->model_path);
    add_text(&sha, scene->mesh_path);
    add_text(&sha, scene->tube_points_path);
    add_text(&sha, scene->shape_name);
    for (int i = 0; i < scene->shape_option_count; i++) {
        add_text(&sha, scene->shape_option[i][0]);
        add_text(&sha, scene->shape_option[i][1]);
    }
    for (int i = 0; i < tube->piece_count; i++) {
        const TubePiece *piece = &tube->piece[i];
        double of_piece[] = {piece->length, piece->arc_radius, piece->angle, piece->plane};
        sha256_add(&sha, of_piece, sizeof of_piece);
    }
    for (int i = 0; i < tube->point_count; i++)
        sha256_add(&sha, (double[3]){tube->point[i].x, tube->point[i].y, tube->point[i].z}, 3 * sizeof(double));
    // a mesh is opened only if the tool begins in it
    if (scene->source == SOURCE_MESH)
        sha256_add(&sha,
                   (double[7]){scene->wire.start.x, scene->wire.start.y, scene->wire.start.z, scene->wire.direction.x, scene->wire.direction.y,
                               scene->wire.direction.z, scene->wire.inserted},
                   7 * sizeof(double));
    sha256_end(&sha, key);
}

static void discard_oldest(VesselStore *store)
{
    int unused = 0;
    Kept **oldest = NULL;
    for (Kept **at = &store->first; *at; at = &(*at)->next) {
        unused += (*at)->users == 0;
        if ((*at)->users == 0 && (!oldest || (*at)->last < (*oldest)->last))
            oldest = at;
    }
    if (unused <= UNUSED_MOST)
        return;
    Kept *gone = *oldest;
    *oldest = gone->next;
    open_vessel_close(&gone->open);
    free(gone);
}

static Kept *take(VesselStore *store, const Scene *scene, const char *key, Faults *faults)
{
    for (Kept *kept = store->first; kept; kept = kept->next)
        if (!strcmp(kept->key, key))
            return kept;
    Kept *kept = HEAP_ZEROED(1, sizeof *kept);
    if (!open_vessel(scene, &(OpenVesselOptions){0}, &kept->open, faults)) {
        open_vessel_close(&kept->open);
        free(kept);
        return NULL;
    }
    strcpy(kept->key, key);
    kept->next = store->first;
    store->first = kept;
    return kept;
}

const OpenVessel *vessel_store_take(VesselStore *store, const Scene *scene, Faults *faults)
{
    char key[KEY];
    make_key(scene, key);
    pthread_mutex_lock(store->files);
    Kept *kept = take(store, scene, key, faults);
    if (kept) {
        kept->users++;
        kept->last = ++store->calls;
        discard_oldest(store);
    }
    pthread_mutex_unlock(store->files);
    return kept ? &kept->open : NULL;
}

void vessel_store_give(VesselStore *store, const OpenVessel *open)
{
    pthread_mutex_lock(store->files);
    for (Kept *kept = store->first; kept; kept = kept->next)
        if (&kept->open == open) {
            SEL_ASSERT(kept->users > 0, "what is given back was taken");
            kept->users--;
        }
    pthread_mutex_unlock(store->files);
}

void vessel_store_free(VesselStore *store)
{
    while (store && store->first) {
        Kept *kept = store->first;
        store->first = kept->next;
        open_vessel_close(&kept->open);
        free(kept);
    }
    free(store);
}
