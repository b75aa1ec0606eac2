#include "render/page.h"

#include <math.h>
#include <stdbool.h>
#include <string.h>

const char page_style[] =
    ":root{color-scheme:light "
    "dark;--paper:#fff;--ink:#1a1d21;--muted:#545b64;--rule:#c9ced6;--panel:#f4f6f8;--o1:#0b5fa5;--o2:#a8480a;--o3:#00725a;--o4:#8a2d73;"
    "--o5:#6b5a00;--o6:#4a4f57;--bad:#b3001b;--wide:#8a5a00;--sac:#7a2ba0}\n"
    "@media "
    "(prefers-color-scheme:dark){:root{--paper:#14171a;--ink:#eceff2;--muted:#aeb6c0;--rule:#464d56;--panel:#1e2328;--o1:#6fb8f5;--o2:#f2a268;--o3:#4fd1ad;"
    "--o4:#e59ad2;--o5:#e3cc5c;--o6:#c3c9d1;--bad:#ff8080;--wide:#f0b849;--sac:#d59bf2}}\n"
    "body{font:16px/1.5 system-ui,sans-serif;color:var(--ink);background:var(--paper);max-width:72rem;margin:0 auto;padding:1.5rem}\n"
    "h1{font-size:1.6rem;line-height:1.2;margin:.2rem 0}h2{font-size:1.2rem;margin:2rem 0 .5rem;border-bottom:1px solid var(--rule)}\n"
    ".notice{border-left:4px solid var(--bad);background:var(--panel);padding:.6rem 1rem;margin:1rem 0}\n"
    "table{border-collapse:collapse;width:100%;font-size:.9rem}caption{text-align:left;color:var(--muted);padding:.3rem 0}\n"
    "th,td{padding:.25rem .6rem;border-bottom:1px solid var(--rule);text-align:right;font-variant-numeric:tabular-nums}\n"
    "th:first-child,td:first-child,.words{text-align:left}thead th{border-bottom:2px solid var(--muted)}\n"
    ".scroll{overflow-x:auto}dl{display:grid;grid-template-columns:max-content 1fr;gap:.2rem "
    "1.2rem;margin:0}dt{color:var(--muted)}dd{margin:0;overflow-wrap:anywhere}\n"
    "figure{margin:1rem 0}figcaption{color:var(--muted);font-size:.9rem}svg{max-width:100%;height:auto;background:var(--panel);margin:0 .5rem .5rem 0}\n"
    "svg text{fill:var(--ink);font:12px system-ui,sans-serif}svg text.tick{fill:var(--muted);font-size:11px}\n"
    ".label{paint-order:stroke;stroke:var(--panel);stroke-width:3px;font-weight:600}.plots{display:flex;flex-wrap:wrap;gap:.5rem}.plots figure{margin:0}\n"
    ".o1{color:var(--o1)}.o2{color:var(--o2)}.o3{color:var(--o3)}.o4{color:var(--o4)}.o5{color:var(--o5)}.o6{color:var(--o6)}\n"
    ".tube{fill:currentColor;fill-opacity:.28;stroke:none}.line{fill:none;stroke:currentColor;stroke-width:1.5}.sac{fill:var(--sac);fill-opacity:.15;stroke:"
    "var(--sac)}\n"
    ".root{fill:var(--paper);stroke:var(--ink);stroke-width:2}.axis{fill:none;stroke:var(--ink)}.grid{stroke:var(--rule)}.border{stroke:var(--ink);stroke-"
    "dasharray:4 3}\n"
    ".mark{fill:none;stroke:currentColor;stroke-width:2.5}.reference{stroke:currentColor;stroke-width:1.5;stroke-dasharray:3 2}\n"
    ".stenosis{color:var(--bad)}.dilatation{color:var(--wide)}.aneurysm{color:var(--sac)}svg .stenosis text,svg .dilatation text,svg .aneurysm "
    "text{fill:currentColor}\n"
    ".c1{fill:var(--o3)}.c2{fill:var(--o1)}.c3{fill:var(--o2)}.c4{fill:var(--bad)}.key span{margin-right:1.2rem;font-weight:600}\n"
    "pre{white-space:pre-wrap;background:var(--panel);padding:.8rem;font-size:.8rem}\n"
    "@media "
    "print{:root{--paper:#fff;--ink:#000;--muted:#444;--rule:#bbb;--panel:#fff;--o1:#0b5fa5;--o2:#a8480a;--o3:#00725a;--o4:#8a2d73;--o5:#6b5a00;--o6:#4a4f57;"
    "--bad:#b3001b;--wide:#8a5a00;--sac:#7a2ba0}body{max-width:none;padding:0;font-size:11pt}figure,tr,svg{break-inside:avoid}h2{break-after:avoid}}\n";

// The length of the UTF-8 character at s; 0 if it is invalid or not allowed in HTML.
static int character_length(const unsigned char *s)
{
    if (s[0] < 0x80)
        return s[0] >= 0x20 || s[0] == '\n' || s[0] == '\t' ? s[0] != 0x7f : 0;
    int length = s[0] >= 0xf0 && s[0] < 0xf5 ? 4 : s[0] >= 0xe0 && s[0] < 0xf0 ? 3 : s[0] >= 0xc2 && s[0] < 0xe0 ? 2 : 0;
    for (int i = 1; i < length; i++)
        if ((s[i] & 0xc0) != 0x80)
            return 0;
    bool overlong = (s[0] == 0xe0 && s[1] < 0xa0) || (s[0] == 0xf0 && s[1] < 0x90), surrogate = s[0] == 0xed && s[1] >= 0xa0;
    bool control = s[0] == 0xc2 && s[1] < 0xa0, none = (s[0] == 0xf4 && s[1] >= 0x90) || (s[0] == 0xef && s[1] == 0xbf && s[2] >= 0xbe);
    return overlong || surrogate || control || none ? 0 : length;
}

void page_text(FILE *out, const char *text)
{
    for (const unsigned char *s = (const unsigned char *)(text ? text : ""); *s;) {
        int length = character_length(s);
        if (*s == '&' || *s == '<' || *s == '>' || *s == '"')
            fputs(*s == '&' ? "&amp;" : *s == '<' ? "&lt;" : *s == '>' ? "&gt;" : "&quot;", out);
        else if (length > 0)
            fwrite(s, 1, (size_t)length, out);
        else
            fputs("\xef\xbf\xbd", out);
        s += length > 0 ? length : 1;
    }
}

void page_begin(FILE *out, const char *kind, const char *title, const char *style)
{
    fprintf(out,
            "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"/><meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n"
            "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'unsafe-inline'\"/>\n<title>%s: ",
            kind);
    page_text(out, title);
    fprintf(out, "</title>\n<style>\n%s%s</style></head>\n<body><header><h1>", page_style, style);
    page_text(out, title);
    fprintf(out, "</h1>\n");
}
