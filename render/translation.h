// The texts of the windows in the user's language, by gettext: catalogues seldinger.mo in locale/LANGUAGE/LC_MESSAGES beside the program or in ../share. The
// functions of render/gui.h translate what they show; a text that is put together before needs tr() around its format. po/README says how to add a language.
#ifndef SELDINGER_RENDER_TRANSLATION_H
#define SELDINGER_RENDER_TRANSLATION_H

#ifdef __cplusplus
extern "C" {
#endif

// Marks a text in a table for xgettext; it is translated where it is shown.
#define N_(text) text

// Finds the catalogue of the user's language (LANGUAGE, LC_ALL, LC_MESSAGES, LANG). Without one the texts remain English. Numbers keep their points.
void translation_begin(void);
// Uses this function instead of a catalogue; NULL: the catalogue again. It returns texts that live until the end. For tests.
void translation_replace(const char *(*translate)(const char *text));

// The translation of a text or format; the text itself without one.
const char *tr(const char *text) __attribute__((format_arg(1)));
// Of one thing, or of several.
const char *tr_n(const char *one, const char *several, unsigned long count) __attribute__((format_arg(1), format_arg(2)));

#ifdef __cplusplus
}
#endif
#endif
