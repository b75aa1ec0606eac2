#include "render/translation.h"

#include "base/base.h"

#include <libintl.h>
#include <locale.h>
#include <stdbool.h>
#include <stddef.h>
#include <unistd.h>

static const char domain[] = "seldinger";
static bool has_catalogue;
static const char *(*replacement)(const char *text);

void translation_begin(void)
{
    static const char *const place[] = {"locale", "../share/locale"};
    char folder[4096];
    has_catalogue = false;
    for (int i = 0; i < 2 && !has_catalogue; i++)
        if (process_beside(place[i], folder, sizeof folder) && access(folder, R_OK | X_OK) == 0)
            has_catalogue = setlocale(LC_MESSAGES, "") && bindtextdomain(domain, folder) && bind_textdomain_codeset(domain, "UTF-8");
}

void translation_replace(const char *(*translate)(const char *text)) { replacement = translate; }

// An empty text would give the head of the catalogue.
const char *tr(const char *text) { return !text || !*text ? text : replacement ? replacement(text) : has_catalogue ? dgettext(domain, text) : text; }

const char *tr_n(const char *one, const char *several, unsigned long count)
{
    return replacement || !has_catalogue ? tr(count == 1 ? one : several) : dngettext(domain, one, several, count);
}
