#include "base/yaml_edit.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <yaml.h>

// Converts a libyaml mark, which counts characters without the byte-order mark, to a byte offset.
static size_t byte_of(const char *text, size_t characters)
{
    size_t at = strncmp(text, "\xEF\xBB\xBF", 3) == 0 ? 3 : 0;
    for (; text[at] && characters > 0; characters--)
        for (at++; ((unsigned char)text[at] & 0xC0) == 0x80;)
            at++;
    return at;
}

// Keys and values of a map one after the other, items of a list.
static int child_count(const yaml_node_t *node)
{
    return node->type == YAML_SEQUENCE_NODE  ? (int)(node->data.sequence.items.top - node->data.sequence.items.start)
           : node->type == YAML_MAPPING_NODE ? 2 * (int)(node->data.mapping.pairs.top - node->data.mapping.pairs.start)
                                             : 0;
}

static int child_of(const yaml_node_t *node, int i)
{
    if (node->type == YAML_SEQUENCE_NODE)
        return node->data.sequence.items.start[i];
    return i % 2 ? node->data.mapping.pairs.start[i / 2].value : node->data.mapping.pairs.start[i / 2].key;
}

// Where a list has the item with that index, or a map the value of that key, among its children (child_of). -1: nowhere.
static int position_of(yaml_document_t *document, const yaml_node_t *node, const char *key, size_t length)
{
    if (node->type == YAML_SEQUENCE_NODE) {
        char *end;
        long index = *key >= '0' && *key <= '9' ? strtol(key, &end, 10) : -1;
        return index >= 0 && end == key + length && index < child_count(node) ? (int)index : -1;
    }
    for (int i = 0; i < child_count(node); i += 2) {
        const yaml_node_t *name = yaml_document_get_node(document, child_of(node, i));
        if (name->type == YAML_SCALAR_NODE && name->data.scalar.length == length && !memcmp(name->data.scalar.value, key, length))
            return i + 1;
    }
    return -1;
}

static yaml_node_t *value_of(yaml_document_t *document, const yaml_node_t *node, const char *key, size_t length)
{
    int at = position_of(document, node, key, length);
    return at >= 0 ? yaml_document_get_node(document, child_of(node, at)) : NULL;
}

static void write_quoted(FILE *stream, const char *value)
{
    fputc('"', stream);
    for (; *value; value++) {
        if (*value == '"' || *value == '\\')
            fputc('\\', stream);
        fputc(*value, stream);
    }
    fputc('"', stream);
}

// Replaces the bytes from `from` to `to` by `before`, the value (quoted if `is_quoted`) and `after`.
static char *spliced(const char *text, size_t from, size_t to, const char *before, const char *value, bool is_quoted, const char *after)
{
    char *out = NULL;
    size_t length;
    FILE *stream = open_memstream(&out, &length);
    if (!stream)
        return NULL;
    fwrite(text, 1, from, stream);
    fputs(before, stream);
    if (is_quoted)
        write_quoted(stream, value);
    else
        fputs(value, stream);
    fprintf(stream, "%s%s", after, text + to);
    if (fclose(stream) == 0)
        return out;
    free(out);
    return NULL;
}

// Finds the map or list that contains the last key of a path and sets *key to that key; NULL if it does not exist.
static const yaml_node_t *parent_of(yaml_document_t *document, const char *path, const char **key)
{
    const yaml_node_t *map = yaml_document_get_root_node(document);
    *key = path;
    for (const char *dot; map && (dot = strchr(*key, '.')); *key = dot + 1)
        map = value_of(document, map, *key, (size_t)(dot - *key));
    return map && map->type != YAML_SCALAR_NODE ? map : NULL;
}

// Adds a missing key before the other keys of its map.
static char *with_key(const char *text, const yaml_node_t *map, const char *key, const char *opening, const char *value, bool is_quoted, const char *closing)
{
    char before[256], after[300] = "";
    size_t at = byte_of(text, map->start_mark.index);
    bool is_flow = map->data.mapping.style == YAML_FLOW_MAPPING_STYLE;
    if ((size_t)snprintf(before, sizeof before, "%s: %s", key, opening) >= sizeof before)
        return NULL;
    if (is_flow) {
        snprintf(after, sizeof after, "%s%s", closing, map->data.mapping.pairs.start < map->data.mapping.pairs.top ? ", " : "");
        return spliced(text, at + 1, at + 1, before, value, is_quoted, after);
    }
    // the next key is placed below this one
    int column = map->start_mark.column < 250 ? (int)map->start_mark.column : 250;
    snprintf(after, sizeof after, "%s\n%*s", closing, column, "");
    return spliced(text, at, at, before, value, is_quoted, after);
}

static size_t end_of_block(const char *text, size_t from, size_t to);

typedef enum { EDIT_SCALAR, EDIT_FLOW, EDIT_ITEM } EditKind;     // a scalar, any value in flow style, an item appended to a list

static char *edit_document(yaml_document_t *document, const char *text, const char *path, const char *value, bool add, EditKind kind)
{
    const char *key;
    const yaml_node_t *map = parent_of(document, path, &key), *node = map ? value_of(document, map, key, strlen(key)) : NULL;
    if (!node)
        return map && map->type == YAML_MAPPING_NODE && add ? with_key(text, map, key, "", value, kind == EDIT_SCALAR, "") : NULL;
    size_t from = byte_of(text, node->start_mark.index), to = byte_of(text, node->end_mark.index);
    bool is_block = (node->type == YAML_MAPPING_NODE && node->data.mapping.style == YAML_BLOCK_MAPPING_STYLE) ||
                    (node->type == YAML_SEQUENCE_NODE && node->data.sequence.style == YAML_BLOCK_SEQUENCE_STYLE);
    if (is_block)
        to = end_of_block(text, from, to);
    bool ends_line = to > from && text[to - 1] == '\n';   // the end mark of a block value is the next token
    // an empty value begins directly after its colon
    return spliced(text, from, to, from == to ? " " : "", value, kind == EDIT_SCALAR, ends_line ? "\n" : "");
}

// The end of the last line of the last item: comments and blank lines after it belong to what follows the list.
static size_t end_of_block(const char *text, size_t from, size_t to)
{
    size_t end = from;
    while (from < to) {
        size_t line = strcspn(text + from, "\n"), blank = strspn(text + from, " \t\r");
        if (from + blank < to && blank < line && text[from + blank] != '#')
            end = from + line;
        from += line + 1;
    }
    return end;
}

static char *append_item(yaml_document_t *document, const char *text, const char *path, const char *item)
{
    const char *key;
    const yaml_node_t *map = parent_of(document, path, &key), *list = map ? value_of(document, map, key, strlen(key)) : NULL;
    if (!list)
        return map && map->type == YAML_MAPPING_NODE ? with_key(text, map, key, "[", item, false, "]") : NULL;
    if (list->type != YAML_SEQUENCE_NODE)
        return NULL;
    size_t from = byte_of(text, list->start_mark.index), to = byte_of(text, list->end_mark.index);
    if (list->data.sequence.style == YAML_FLOW_SEQUENCE_STYLE)
        return spliced(text, to - 1, to - 1, list->data.sequence.items.start < list->data.sequence.items.top ? ", " : "", item, false, "");
    char before[300];
    int column = list->start_mark.column < 250 ? (int)list->start_mark.column : 250;
    size_t end = end_of_block(text, from, to);
    snprintf(before, sizeof before, "\n%*s- ", column, "");
    return spliced(text, end, end, before, item, false, "");
}

static bool is_at_end(yaml_parser_t *parser)
{
    yaml_document_t next;
    if (!yaml_parser_load(parser, &next))
        return false;
    bool ended = !yaml_document_get_root_node(&next);
    yaml_document_delete(&next);
    return ended;
}

// Loads the only document of a text; the caller deletes it.
static bool load(const char *text, yaml_document_t *document)
{
    yaml_parser_t parser;
    if (!yaml_parser_initialize(&parser))
        return false;
    yaml_parser_set_input_string(&parser, (const unsigned char *)text, strlen(text));
    bool loaded = yaml_parser_load(&parser, document), good = loaded && is_at_end(&parser);
    if (loaded && !good)
        yaml_document_delete(document);
    yaml_parser_delete(&parser);
    return good;
}

// --- the edited text is read again ---

// Compares values of two documents. A value that aliases repeat is compared once: partner[x] is the node of b that stands where x stands in a.
typedef struct Comparison {
    yaml_document_t *a, *b;
    int *partner;
} Comparison;

static Comparison comparison_of(yaml_document_t *a, yaml_document_t *b)
{
    size_t nodes = (size_t)(a->nodes.top - a->nodes.start);
    return (Comparison){a, b, calloc(nodes + 1, sizeof(int))};
}

static bool same(const Comparison *c, int x, int y)
{
    const yaml_node_t *a = yaml_document_get_node(c->a, x), *b = yaml_document_get_node(c->b, y);
    if (!a || !b || a->type != b->type)
        return false;
    if (a->type == YAML_SCALAR_NODE)
        return a->data.scalar.length == b->data.scalar.length && !memcmp(a->data.scalar.value, b->data.scalar.value, a->data.scalar.length);
    if (c->partner[x])
        return c->partner[x] == y;
    c->partner[x] = y;
    bool good = child_count(a) == child_count(b);
    for (int i = 0; good && i < child_count(a); i++)
        good = same(c, child_of(a, i), child_of(b, i));
    return good;
}

// Node `y` of the new document is the value that was to be set in place of node `x`, or the list of it with the value at its end.
static bool is_wanted(Comparison *c, int x, int y, const char *value, EditKind kind)
{
    const yaml_node_t *old = yaml_document_get_node(c->a, x), *node = yaml_document_get_node(c->b, y);
    if (kind == EDIT_SCALAR)
        return node->type == YAML_SCALAR_NODE && !strcmp((const char *)node->data.scalar.value, value);
    if (kind == EDIT_ITEM) {
        int before = old ? child_count(old) : 0;
        bool good = node->type == YAML_SEQUENCE_NODE && child_count(node) == before + 1;
        for (int i = 0; good && i < before; i++)
            good = same(c, child_of(old, i), child_of(node, i));
        if (!good)
            return false;
        y = child_of(node, before);
    }
    yaml_document_t wanted;
    if (!load(value, &wanted))
        return false;
    Comparison with_value = comparison_of(&wanted, c->b);
    bool good = with_value.partner && same(&with_value, 1, y);
    free(with_value.partner);
    yaml_document_delete(&wanted);
    return good;
}

// Node `y` is node `x` with another value at `path`, and nothing else has changed.
static bool is_edited(Comparison *c, int x, int y, const char *path, const char *value, EditKind kind)
{
    const yaml_node_t *a = yaml_document_get_node(c->a, x), *b = yaml_document_get_node(c->b, y);
    size_t length = strcspn(path, ".");
    int at = a->type == b->type ? position_of(c->a, a, path, length) : -1, added = 0;
    if (at < 0) {        // a key that was missing is the first now
        added = 2;
        at = b->type == YAML_MAPPING_NODE && !path[length] && position_of(c->b, b, path, length) == 1 ? 1 : -1;
    }
    bool good = at >= 0 && child_count(b) == child_count(a) + added;
    for (int i = 0; good && i < child_count(b); i++) {
        int old = i >= added ? child_of(a, i - added) : 0, new = child_of(b, i);
        if (i != at)
            good = i < added || same(c, old, new);
        else
            good = path[length] ? is_edited(c, old, new, path + length + 1, value, kind) : is_wanted(c, old, new, value, kind);
    }
    return good;
}

// Aliases, tags, comments in the value, and keys that begin with `?` can make another text than the intended one.
static bool is_good(yaml_document_t *before, const char *text, const char *path, const char *value, EditKind kind)
{
    yaml_document_t after;
    if (!load(text, &after))
        return false;
    Comparison c = comparison_of(before, &after);
    bool good = c.partner && yaml_document_get_root_node(&after) && is_edited(&c, 1, 1, path, value, kind);
    free(c.partner);
    yaml_document_delete(&after);
    return good;
}

static char *edit(const char *text, const char *path, const char *value, bool add, EditKind kind)
{
    yaml_document_t document;
    if (!load(text, &document))
        return NULL;
    char *out = kind == EDIT_ITEM ? append_item(&document, text, path, value) : edit_document(&document, text, path, value, add, kind);
    if (out && !is_good(&document, out, path, value, kind)) {
        free(out);
        out = NULL;
    }
    yaml_document_delete(&document);
    return out;
}

char *yaml_edit(const char *text, const char *path, const char *value, bool add) { return edit(text, path, value, add, EDIT_SCALAR); }

char *yaml_edit_flow(const char *text, const char *path, const char *flow, bool add) { return edit(text, path, flow, add, EDIT_FLOW); }

char *yaml_edit_append(const char *text, const char *path, const char *item) { return edit(text, path, item, true, EDIT_ITEM); }
