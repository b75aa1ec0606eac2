// Texts for people that are put together here, in the language of the window that shows them: it gives the function that translates. Reports and files are
// English.
#ifndef SELDINGER_SIM_WORDS_H
#define SELDINGER_SIM_WORDS_H

// The translation of a text or format; it lives until the end. Literals that it is called with are in the translators' template (tests/tools/translations).
typedef const char *(*Words)(const char *text) __attribute__((format_arg(1)));

static inline const char *words_english(const char *text) { return text; }

#endif
