// A mesh comes back bit for bit; anything else than exactly these bytes is refused.
#include "recon/surface/mesh_pack.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "tests/geom/small_meshes.h"

static const ContentDigest key = {{1, 2, 3, 4}};

static TriangleMesh ball_with_nodes(void)
{
    TriangleMesh ball = sphere_mesh(3);
    ball.node = calloc((size_t)ball.vertex_count, sizeof *ball.node);
    for (int v = 0; v < ball.vertex_count; v++)
        ball.node[v] = v % 5;
    return ball;
}

static void clear(TriangleMesh *ball)
{
    free(ball->node);
    mesh_clear(ball);
}

static bool is_accepted(const uint8_t *bytes, size_t length, const ContentDigest *of)
{
    // in a block of its own, so that a sanitizer sees a read beyond the end
    uint8_t *copy = malloc(length + !length);
    if (length > 0)
        memcpy(copy, bytes, length);
    TriangleMesh *mesh = mesh_unpack(copy, length, of);
    bool accepted = mesh != NULL;
    triangle_mesh_free(mesh);
    free(copy);
    return accepted;
}

// With the right checksum, as a program of another version would write it.
static bool is_accepted_signed(uint8_t *bytes, size_t length)
{
    ContentDigest digest = content_digest_begin();
    content_digest_add(&digest, bytes, length - sizeof digest);
    memcpy(bytes + length - sizeof digest, &digest, sizeof digest);
    return is_accepted(bytes, length, &key);
}

static void a_mesh_comes_back(void **state)
{
    (void)state;
    TriangleMesh ball = ball_with_nodes();
    size_t length = 0;
    ball.vertex[0].x = -0.0;
    ball.normal[1] = vec3(NAN, 0, 0);
    uint8_t *bytes = mesh_pack(&ball, &key, &length);
    assert_non_null(bytes);
    TriangleMesh *back = mesh_unpack(bytes, length, &key);
    assert_non_null(back);
    assert_int_equal(back->vertex_count, ball.vertex_count);
    assert_int_equal(back->triangle_count, ball.triangle_count);
    assert_memory_equal(back->vertex, ball.vertex, (size_t)ball.vertex_count * sizeof *ball.vertex);
    assert_memory_equal(back->normal, ball.normal, (size_t)ball.vertex_count * sizeof *ball.normal);
    assert_memory_equal(back->node, ball.node, (size_t)ball.vertex_count * sizeof *ball.node);
    assert_memory_equal(back->triangle, ball.triangle, (size_t)ball.triangle_count * sizeof *ball.triangle);
    triangle_mesh_free(back);
    free(bytes);
    clear(&ball);
}

static void damage_is_refused(void **state)
{
    (void)state;
    TriangleMesh ball = ball_with_nodes();
    size_t length = 0;
    uint8_t *bytes = mesh_pack(&ball, &key, &length), *longer = calloc(1, length + 1);
    assert_true(is_accepted(bytes, length, &key));
    for (size_t part = 0; part < length; part++)
        assert_false(is_accepted(bytes, part, &key));
    for (size_t bit = 0; bit < 8 * length; bit += 3) {
        bytes[bit / 8] ^= (uint8_t)(1 << bit % 8);
        assert_false(is_accepted(bytes, length, &key));
        bytes[bit / 8] ^= (uint8_t)(1 << bit % 8);
    }
    memcpy(longer, bytes, length);
    assert_false(is_accepted(longer, length + 1, &key));
    free(longer);
    free(bytes);
    clear(&ball);
}

static void another_key_or_version_is_refused(void **state)
{
    (void)state;
    enum { VERSION_AT = 8, VERTICES_AT = 12, KEY_AT = 24 };
    TriangleMesh ball = ball_with_nodes();
    size_t length = 0;
    uint8_t *bytes = mesh_pack(&ball, &key, &length);
    assert_true(is_accepted_signed(bytes, length));
    const size_t places[] = {0, VERSION_AT, VERTICES_AT, KEY_AT, KEY_AT + 31};
    for (size_t i = 0; i < sizeof places / sizeof *places; i++) {
        bytes[places[i]]++;
        assert_false(is_accepted_signed(bytes, length));
        bytes[places[i]]--;
    }
    assert_true(is_accepted_signed(bytes, length));
    free(bytes);
    clear(&ball);
}

static void values_that_cannot_be_are_refused(void **state)
{
    (void)state;
    TriangleMesh ball = ball_with_nodes();
    size_t length = 0;
    const double place = ball.vertex[7].y;
    ball.vertex[7].y = INFINITY;
    uint8_t *bytes = mesh_pack(&ball, &key, &length);
    assert_false(is_accepted(bytes, length, &key));
    free(bytes);
    ball.vertex[7].y = place;
    for (int k = -1; k <= ball.vertex_count; k += ball.vertex_count + 1) {
        ball.triangle[3][1] = k;
        bytes = mesh_pack(&ball, &key, &length);
        assert_false(is_accepted(bytes, length, &key));
        free(bytes);
    }
    int *node = ball.node;
    ball.node = NULL;
    assert_null(mesh_pack(&ball, &key, &length));
    ball.node = node;
    clear(&ball);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(a_mesh_comes_back), cmocka_unit_test(damage_is_refused),
                                       cmocka_unit_test(another_key_or_version_is_refused), cmocka_unit_test(values_that_cannot_be_are_refused)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
