#include "sim/surface_cache.h"

#include "base/base.h"
#include "recon/recon.h"

#include <dirent.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { CACHE_PATH = 4096, FILES_MOST = 4096 };
static const char prefix[] = "surface-", ending[] = ".mesh";

// --- keys ---

static void add_array(ContentDigest *key, const void *array, size_t count, size_t size) { content_digest_add(key, array, array ? count * size : 0); }

static ContentDigest begin_key(const char *what)
{
    char program[PROCESS_CODE_ID];
    ContentDigest key = content_digest_begin();
    process_code_id(program);
    content_digest_add(&key, program, strlen(program));
    content_digest_add(&key, what, strlen(what));
    return key;
}

// Whether the neighbours are listed follows from the rest (vessel_tree_link).
static ContentDigest key_of_tree(const VesselTree *tree, double cell_mm)
{
    const size_t nodes = (size_t)tree->node_count, blobs = (size_t)tree->blob_count, points = (size_t)tree->point_count;
    ContentDigest key = begin_key("isosurface");
    content_digest_add(&key, &cell_mm, sizeof cell_mm);
    content_digest_add(&key, &tree->iso_level, sizeof tree->iso_level);
    add_array(&key, tree->center, nodes, sizeof *tree->center);
    add_array(&key, tree->radius, nodes, sizeof *tree->radius);
    add_array(&key, tree->direction, nodes, sizeof *tree->direction);
    add_array(&key, tree->height, nodes, sizeof *tree->height);
    add_array(&key, tree->parent, nodes, sizeof *tree->parent);
    add_array(&key, tree->kind, nodes, sizeof *tree->kind);
    add_array(&key, tree->point, points, sizeof *tree->point);
    add_array(&key, tree->point_offset, nodes + 1, sizeof *tree->point_offset);
    add_array(&key, tree->blob_center, blobs, sizeof *tree->blob_center);
    add_array(&key, tree->blob_width, blobs, sizeof *tree->blob_width);
    add_array(&key, tree->blob_amplitude, blobs, sizeof *tree->blob_amplitude);
    add_array(&key, tree->blob_offset, nodes + 1, sizeof *tree->blob_offset);
    return key;
}

static ContentDigest key_of_mesh(const TriangleMesh *mesh, int triangles)
{
    const size_t vertices = (size_t)mesh->vertex_count;
    ContentDigest key = begin_key("decimation");
    content_digest_add(&key, &triangles, sizeof triangles);
    add_array(&key, mesh->vertex, vertices, sizeof *mesh->vertex);
    add_array(&key, mesh->normal, vertices, sizeof *mesh->normal);
    add_array(&key, mesh->node, vertices, sizeof *mesh->node);
    add_array(&key, mesh->triangle, (size_t)mesh->triangle_count, sizeof *mesh->triangle);
    return key;
}

// --- files ---

static bool find_folder(char folder[CACHE_PATH]) { return folders_cache(folder, CACHE_PATH - 128) && folders_create(folder); }

static bool name_file(const ContentDigest *key, char path[CACHE_PATH])
{
    char folder[CACHE_PATH], hex[65];
    content_digest_hex(key, hex);
    return find_folder(folder) && snprintf(path, CACHE_PATH, "%s/%s%.32s%s", folder, prefix, hex, ending) < CACHE_PATH;
}

static TriangleMesh *load(const ContentDigest *key)
{
    char path[CACHE_PATH];
    Faults *ignored = calloc(1, sizeof *ignored);
    size_t length = 0;
    char *bytes =
        ignored && name_file(key, path) && access(path, R_OK) == 0 ? whole_file_read_most(path, (size_t)SURFACE_CACHE_MB << 20, &length, ignored) : NULL;
    TriangleMesh *mesh = bytes ? mesh_unpack((const uint8_t *)bytes, length, key) : NULL;
    if (mesh)
        utimensat(AT_FDCWD, path, NULL, 0);      // used now; a folder without write permission keeps its times
    free(bytes);
    free(ignored);
    return mesh;
}

typedef struct CachedFile {
    char name[64];
    struct timespec used;
    off_t size;
} CachedFile;

static bool is_ours(const char *name)
{
    const size_t length = strlen(name), tail = sizeof ending - 1;
    return length < sizeof((CachedFile *)NULL)->name && length > tail && strncmp(name, prefix, sizeof prefix - 1) == 0 &&
           strcmp(name + length - tail, ending) == 0;
}

static int compare_latest(const void *a, const void *b)
{
    const struct timespec *x = &((const CachedFile *)a)->used, *y = &((const CachedFile *)b)->used;
    if (x->tv_sec != y->tv_sec)
        return x->tv_sec < y->tv_sec ? 1 : -1;
    return x->tv_nsec < y->tv_nsec ? 1 : x->tv_nsec > y->tv_nsec ? -1 : strcmp(((const CachedFile *)a)->name, ((const CachedFile *)b)->name);
}

// Another program may remove a file at the same time, or still read one that goes: it has it open.
static void remove_oldest(void)
{
    char folder[CACHE_PATH];
    CachedFile *file = malloc(FILES_MOST * sizeof *file);
    DIR *directory = file && find_folder(folder) ? opendir(folder) : NULL;
    int count = 0;
    off_t kept = 0;
    for (const struct dirent *entry; directory && count < FILES_MOST && (entry = readdir(directory)) != NULL;) {
        struct stat status;
        if (!is_ours(entry->d_name) || fstatat(dirfd(directory), entry->d_name, &status, AT_SYMLINK_NOFOLLOW) != 0)
            continue;
        file[count] = (CachedFile){.used = status.st_mtim, .size = status.st_size};
        strcpy(file[count++].name, entry->d_name);
    }
    if (count > 0)
        qsort(file, (size_t)count, sizeof *file, compare_latest);
    for (int i = 0; i < count; i++)
        if ((kept += file[i].size) > (off_t)SURFACE_CACHE_MB << 20)
            unlinkat(dirfd(directory), file[i].name, 0);
    if (directory)
        closedir(directory);
    free(file);
}

static void save(const ContentDigest *key, const TriangleMesh *mesh)
{
    char path[CACHE_PATH];
    size_t length;
    Faults *ignored = calloc(1, sizeof *ignored);
    uint8_t *bytes = mesh && ignored && name_file(key, path) ? mesh_pack(mesh, key, &length) : NULL;
    if (bytes && whole_file_write(path, bytes, length, ignored))
        remove_oldest();
    free(bytes);
    free(ignored);
}

TriangleMesh *cached_isosurface_of_tree(const VesselTree *tree, double cell_mm)
{
    const ContentDigest key = key_of_tree(tree, cell_mm);
    TriangleMesh *mesh = load(&key);
    if (!mesh)
        save(&key, mesh = isosurface_of_tree(tree, cell_mm));
    return mesh;
}

TriangleMesh *cached_decimation(const TriangleMesh *mesh, int triangles)
{
    const ContentDigest key = key_of_mesh(mesh, triangles);
    TriangleMesh *fewer = load(&key);
    if (!fewer)
        save(&key, fewer = mesh_decimate(mesh, triangles, HUGE_VAL));
    return fewer;
}
