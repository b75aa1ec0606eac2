#include "base/plain_json.h"

#include <string.h>

static void print_value(FILE *out, const cJSON *value)
{
    if (cJSON_IsString(value)) {
        fprintf(out, "%s", value->valuestring);
    } else if (cJSON_IsBool(value)) {
        fprintf(out, "%s", cJSON_IsTrue(value) ? "yes" : "no");
    } else if (cJSON_IsNumber(value)) {
        fprintf(out, "%.6g", value->valuedouble);
    } else {
        for (const cJSON *item = value->child; item; item = item->next) {
            if (item->string)
                fprintf(out, "%s ", item->string);
            print_value(out, item);
            if (item->next)
                fprintf(out, ", ");
        }
    }
}

void plain_json_print(FILE *out, const cJSON *object, const char *without)
{
    for (const cJSON *item = object->child; item; item = item->next) {
        if (!strcmp(item->string, without) || (cJSON_IsString(item) && !item->valuestring[0]))
            continue;
        fprintf(out, "%-16s ", item->string);
        print_value(out, item);
        fputc('\n', out);
    }
}
