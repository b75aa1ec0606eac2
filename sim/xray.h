// The operator's settings of X-ray system and injector, sampled at each step and recorded with the command: all floats, so that a row of the
// recording's /xray (S, XRAY_VALUES) is this struct.
#ifndef SELDINGER_SIM_XRAY_H
#define SELDINGER_SIM_XRAY_H

typedef struct XrayControl {
    float pedal;             // 1 while fluoroscopy is on
    float pulses_s;          // 7.5, 10, 15 or 30
    float lao_deg;           // C-arm: LAO > 0, RAO < 0, within 90
    float cra_deg;           // CRA > 0, CAU < 0, within 45
    float field_mm;          // magnification: side of the square seen at the isocentre, 40 to 400
    float table_mm[3];       // where the isocentre lies in the model's frame
    float collimator[4];     // left, right, bottom, top blade: part of half the field that it covers, 0 to 0.95
    float contrast_ml_s;     // requested flow of contrast agent
    float mode;              // XrayMode
    float mask;              // counter of masks for DSA and roadmap: a change takes a new one
    float bookmark;          // counter of bookmarks: a change sets one
    float contrast_tool;     // through which tool: 1 the outermost, 2, …; 0: not given, see sim/contrast_injection.h
    float seen;              // SEEN_ bits of what the trainee's window shows; 0: not known
    float looks;             // counter of times that the 3D view or angioscopy came into sight: a change is a look, also during a pause
} XrayControl;

// Rows of older recordings are shorter: they end before the tool of the contrast agent, or before what the trainee saw. Missing values are 0.
enum { XRAY_VALUES = sizeof(XrayControl) / sizeof(float), XRAY_VALUES_BEFORE_SEEN = XRAY_VALUES - 2, XRAY_VALUES_BEFORE_TOOLS = XRAY_VALUES - 3 };
// What a window shows. Without SEEN_KNOWN (no window, older recordings) everything that the X-rays hit counts as shown, and no 3D view.
enum {
    SEEN_KNOWN = 1,
    SEEN_XRAY = 2,           // the live X-ray image
    SEEN_3D = 4,
    SEEN_ANGIOSCOPY = 8,
    SEEN_EXAMINATION = 16,   // the session is an examination: 3D view and angioscopy are not to be had
    SEEN_TIP = 32,           // shifted by k: the tip of tool k lies in the open field, between the collimator's blades
    SEEN_BIPLANE = 512,      // the second plane is on: its tube gives a pulse with each of the first
    SEEN_MOST = 1023         // all of them, with four tools
};
typedef enum { XRAY_LIVE, XRAY_DSA, XRAY_ROADMAP } XrayMode;

static inline XrayControl xray_default_control(void) { return (XrayControl){.pulses_s = 15, .field_mm = 160}; }

#endif
