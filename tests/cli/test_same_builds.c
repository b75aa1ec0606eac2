// The program gives the same bits for any instruction set and C library; its bill of materials is beside it; and it contains neither the place nor the time of
// the build. The longer part, with other compilers and another processor, is tests/tools/same-builds.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <ctype.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include <cJSON.h>

#include "tests/short_run.h"

static char folder[] = "/tmp/seldinger-same-XXXXXX";
#include "tests/folder.h"
#include "tests/cli/json_file.h"
#include "tests/cli/program.h"

static void need(const char *tool)
{
    char command[100];
    snprintf(command, sizeof command, "command -v %s >/dev/null", tool);
    if (system(command) != 0) {
        print_message("skipped: no %s\n", tool);
        skip();
    }
}

// Whether C libraries round this function differently: base/same_math.h replaces it.
static bool is_rounded_freely(const char *name)
{
    static const char *const inexact[] = {"sin",   "cos",   "tan",   "sincos", "asin", "acos",   "atan",   "atan2", "sinh", "cosh",  "tanh",
                                          "asinh", "acosh", "atanh", "exp",    "exp2", "exp10",  "expm1",  "log",   "log2", "log10", "log1p",
                                          "pow",   "cbrt",  "hypot", "erf",    "erfc", "lgamma", "tgamma", "j0",    "j1",   "y0",    "y1"};
    for (size_t i = 0; i < sizeof inexact / sizeof *inexact; i++) {
        size_t length = strlen(inexact[i]);
        if (!strncmp(name, inexact[i], length) && (!name[length] || ((name[length] == 'f' || name[length] == 'l') && !name[length + 1])))
            return true;
    }
    return false;
}

static void nothing_calls_what_c_libraries_round_differently(void **state)
{
    (void)state;
    need("nm");
    char libraries[] = SAME_LIBRARIES, command[600], line[600];
    int symbols = 0;
    for (char *library = strtok(libraries, ":"); library; library = strtok(NULL, ":")) {
        snprintf(command, sizeof command, "nm -A -u '%s' 2>/dev/null", library);
        FILE *pipe = popen(command, "r");
        assert_non_null(pipe);
        while (fgets(line, sizeof line, pipe)) {
            line[strcspn(line, "\n@")] = 0;
            char *name = strrchr(line, ' ');
            symbols += name != NULL;
            if (name && is_rounded_freely(name + 1))
                fail_msg("%s: call same_%s (base/same_math.h)", line, name + 1);
        }
        assert_int_equal(pclose(pipe), 0);
    }
    assert_true(symbols > 1000);
}

// A processor without fused multiplication would round twice where these round once. gcc 12 makes them of a product and a sum side by side in spite of
// -ffp-contract=off (solver/CMakeLists.txt).
static void no_product_is_fused_with_a_sum(void **state)
{
    (void)state;
    NEED_WHOLE_RUNS();
    need("objdump");
    char command[600];
    snprintf(command, sizeof command, "objdump -d --no-show-raw-insn '%s' | grep -m 3 -E '[[:space:]]vfn?m(add|sub)'", SELDINGER_PROGRAM);
    if (system(command) == 0)
        fail_msg("the program fuses products with sums");
}

// --- the same bits ---

// A curved tool in a vessel whose model is fitted at the start: samples, fit, contact, friction, twist.
static const char fitted[] = "seldinger: 1\n"
                             "vessel: {shape: {name: arc}, friction: 0.1}\n"
                             "wire:\n"
                             "  elements: 60\n"
                             "  sections:\n"
                             "    - {length_mm: 50, diameter_mm: 0.36, young_modulus_gpa: 80}\n"
                             "    - {length_mm: 10, diameter_mm: 0.36, young_modulus_gpa: 5, rest_curvature_1_mm: 0.1}\n"
                             "  damping: {mass_1_s: 0.1, stiffness_s: 0.0002}\n"
                             "sheath: {inlet: root, inserted_mm: 2}\n"
                             "script: [[0, 40, 90], [0.3, 40, 90]]\n";
// Two curved tools in an exact tube, rotated against each other.
static const char several[] = "seldinger: 1\n"
                              "vessel:\n"
                              "  tube: {start_mm: [0, 0, 0], direction: [1, 0, 0], normal: [0, 1, 0], radius_mm: 1.5,\n"
                              "         path: [{line_mm: 20}, {arc: {radius_mm: 15, angle_deg: 120}}, {line_mm: 30}]}\n"
                              "  contact: tube\n"
                              "  friction: 0.1\n"
                              "tools:\n"
                              "  - name: catheter\n"
                              "    kind: catheter\n"
                              "    elements: 40\n"
                              "    inserted_mm: 4\n"
                              "    sections: [{length_mm: 70, diameter_mm: 1.6, inner_diameter_mm: 1.2, young_modulus_gpa: 0.4}, "
                              "{length_mm: 10, diameter_mm: 1.6, inner_diameter_mm: 1.2, young_modulus_gpa: 0.4, rest_curvature_1_mm: 0.08}]\n"
                              "    damping: {mass_1_s: 0.5, stiffness_s: 0.0002}\n"
                              "  - name: wire\n"
                              "    kind: wire\n"
                              "    elements: 50\n"
                              "    inserted_mm: 14\n"
                              "    sections: [{length_mm: 90, diameter_mm: 0.36, young_modulus_gpa: 20}, "
                              "{length_mm: 10, diameter_mm: 0.36, young_modulus_gpa: 5, rest_curvature_1_mm: 0.1}]\n"
                              "    damping: {mass_1_s: 0.5, stiffness_s: 0.0002}\n"
                              "sheath: {entry_mm: [0, 0, 0], direction: [1, 0, 0]}\n"
                              "script:\n"
                              "  - {t_s: 0, catheter.push_mm_s: 30, catheter.twist_deg_s: 90, wire.push_mm_s: 50, wire.twist_deg_s: -120}\n"
                              "  - {t_s: 0.3}\n";

#define NO_FUSED "GLIBC_TUNABLES=glibc.cpu.hwcaps=-AVX2,-FMA,-FMA4,-AVX512F,-AVX512VL,-AVX2_Usable,-FMA_Usable,-FMA4_Usable"
static const char *const variant[] = {"SELDINGER_SIMD=avx512", "SELDINGER_SIMD=avx2", "SELDINGER_SIMD=sse2", NO_FUSED, "SELDINGER_SIMD=sse2 " NO_FUSED};
enum { VARIANTS = sizeof variant / sizeof *variant };

// The state after a run, with a new fit of its model.
static void state_after(const char *scene, const char *environment, char hash[17])
{
    char before[600];
    snprintf(before, sizeof before, "rm -rf cache; env SELDINGER_CACHE=cache %s", environment);
    char arguments[100];
    snprintf(arguments, sizeof arguments, "run %s --summary s.json --quiet", scene);
    if (run_in(before, arguments) != 0)
        fail_msg("%s: %s", environment, output);
    cJSON *json = json_of("s.json");
    snprintf(hash, 17, "%s", cJSON_GetStringValue(cJSON_GetObjectItem(json, "state_hash")));
    cJSON_Delete(json);
}

static void instruction_sets_and_c_libraries_give_the_same_bits(void **state)
{
    (void)state;
    NEED_WHOLE_RUNS();
    const char *const scene[] = {"fitted.yaml", "several.yaml"};
    put(scene[0], fitted);
    put(scene[1], several);
    for (int s = 0; s < 2; s++) {
        char first[17] = "", hash[17];
        for (int v = 0; v < VARIANTS; v++) {
            state_after(scene[s], variant[v], hash);
            print_message("%s %s %s\n", scene[s], hash, variant[v]);
            if (v == 0)
                strcpy(first, hash);
            assert_string_equal(hash, first);
        }
    }
}

// --- the bill of materials ---

static const char *text_in(const cJSON *object, const char *key)
{
    const char *text = cJSON_GetStringValue(cJSON_GetObjectItem(object, key));
    if (!text || !*text)
        fail_msg("the bill of materials has no %s", key);
    return text;
}

// SPDX 2.3, clause 3.2: "SPDXRef-" and letters, digits, points and hyphens.
static void is_identifier(const char *text)
{
    assert_int_equal(strncmp(text, "SPDXRef-", 8), 0);
    assert_true(text[8]);
    for (const char *c = text + 8; *c; c++)
        assert_true(isalnum((unsigned char)*c) || *c == '.' || *c == '-');
}

static bool is_described(const cJSON *packages, const char *id)
{
    const cJSON *package;
    int count = !strcmp(id, "SPDXRef-DOCUMENT");
    cJSON_ArrayForEach(package, packages) count += !strcmp(text_in(package, "SPDXID"), id);
    return count == 1;
}

static void check_package(const cJSON *package, const cJSON *packages)
{
    is_identifier(text_in(package, "SPDXID"));
    assert_true(is_described(packages, text_in(package, "SPDXID")));
    text_in(package, "name");
    text_in(package, "downloadLocation");
    assert_true(cJSON_IsFalse(cJSON_GetObjectItem(package, "filesAnalyzed")));
    text_in(package, "licenseConcluded");
    text_in(package, "copyrightText");
    const cJSON *reference = cJSON_GetArrayItem(cJSON_GetObjectItem(package, "externalRefs"), 0);
    if (reference) {
        text_in(package, "versionInfo");
        assert_string_equal(text_in(reference, "referenceType"), "purl");
        assert_int_equal(strncmp(text_in(reference, "referenceLocator"), "pkg:deb/debian/", 15), 0);
        assert_null(strpbrk(text_in(reference, "referenceLocator"), "+ "));
    }
}

// The fields that SPDX 2.3 requires (clauses 6, 7 and 11), the program's digest, and the program's own libraries.
static void the_bill_of_materials_is_whole(void **state)
{
    (void)state;
    need("sha256sum");
    static const char *const relation[] = {"DESCRIBES", "DYNAMIC_LINK", "STATIC_LINK", "DEPENDS_ON", "BUILD_TOOL_OF"};
    char *text = text_of(SELDINGER_SBOM), command[600], digest[65] = "";
    cJSON *json = cJSON_Parse(text);
    assert_non_null(json);
    assert_string_equal(text_in(json, "spdxVersion"), "SPDX-2.3");
    assert_string_equal(text_in(json, "dataLicense"), "CC0-1.0");
    assert_string_equal(text_in(json, "SPDXID"), "SPDXRef-DOCUMENT");
    text_in(json, "name");
    assert_int_equal(strncmp(text_in(json, "documentNamespace"), "https://", 8), 0);
    assert_null(strchr(text_in(json, "documentNamespace"), '#'));
    const cJSON *creation = cJSON_GetObjectItem(json, "creationInfo");
    struct tm time;
    const char *end = strptime(text_in(creation, "created"), "%Y-%m-%dT%H:%M:%SZ", &time);
    assert_true(end && !*end);
    assert_true(cJSON_GetArraySize(cJSON_GetObjectItem(creation, "creators")) > 0);

    const cJSON *packages = cJSON_GetObjectItem(json, "packages"), *program = cJSON_GetArrayItem(packages, 0), *each;
    assert_string_equal(text_in(program, "name"), "seldinger");
    assert_string_equal(text_in(program, "versionInfo"), SELDINGER_VERSION);
    assert_string_equal(text_in(program, "licenseDeclared"), "MIT");
    snprintf(command, sizeof command, "sha256sum '%s'", SELDINGER_PROGRAM);
    FILE *pipe = popen(command, "r");
    assert_non_null(pipe);
    assert_int_equal(fread(digest, 1, 64, pipe), 64);
    pclose(pipe);
    assert_string_equal(text_in(cJSON_GetArrayItem(cJSON_GetObjectItem(program, "checksums"), 0), "checksumValue"), digest);
    cJSON_ArrayForEach(each, packages) check_package(each, packages);

    const cJSON *relations = cJSON_GetObjectItem(json, "relationships");
    assert_int_equal(cJSON_GetArraySize(relations), cJSON_GetArraySize(packages));       // one of each
    cJSON_ArrayForEach(each, relations)
    {
        bool known = false;
        for (size_t i = 0; i < sizeof relation / sizeof *relation; i++)
            known |= !strcmp(text_in(each, "relationshipType"), relation[i]);
        assert_true(known);
        assert_true(is_described(packages, text_in(each, "spdxElementId")) && is_described(packages, text_in(each, "relatedSpdxElement")));
    }
    if (system("command -v dpkg-query >/dev/null") == 0)
        assert_true(strstr(text, "\"libc6\", \"versionInfo\"") && strstr(text, "\"libhdf5-103-1\", \"versionInfo\""));
    cJSON_Delete(json);
    free(text);
}

static void the_program_does_not_contain_where_it_was_built(void **state)
{
    (void)state;
    NEED_WHOLE_RUNS();       // sanitizers put the names of source files into the program
    need("grep");
    const char *const secret[] = {SOURCE_DIR, BINARY_DIR};
    char command[1200];
    for (int i = 0; i < 2; i++) {
        snprintf(command, sizeof command, "grep -a -o -m 3 -F '%s' '%s'", secret[i], SELDINGER_PROGRAM);
        if (system(command) == 0)
            fail_msg("the program names %s", secret[i]);
    }
}

// The compiler's __DATE__ and __TIME__ would differ from build to build.
static void no_source_asks_for_the_date(void **state)
{
    (void)state;
    assert_int_not_equal(
        system("grep -rnE '__(DATE|TIME|TIMESTAMP)__' base geom solver input recon sim render cli --include=*.c --include=*.h --include=*.cpp --include=*.inc"),
        0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(nothing_calls_what_c_libraries_round_differently),    cmocka_unit_test(no_product_is_fused_with_a_sum),
        cmocka_unit_test(instruction_sets_and_c_libraries_give_the_same_bits), cmocka_unit_test(the_bill_of_materials_is_whole),
        cmocka_unit_test(the_program_does_not_contain_where_it_was_built),     cmocka_unit_test(no_source_asks_for_the_date),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
