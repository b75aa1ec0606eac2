// A run as an HDF5 file (docs/file-formats.md, "Recordings"): scalars of every step, the wire every 10 ms of simulated time.
//
// The simulation thread copies into rings; a writer thread drains them, compresses whole chunks of 0.2 s (shuffle, then deflate; any HDF5 reader can
// read them) and commits them about as often, so no step touches a file. The file opens in any HDF5 reader while it is written and after a kill,
// complete up to the last flush. This is achieved as follows:
//   - it is built under a temporary name and renamed once its first chunks are flushed, so its structure is on disk before it gets its name;
//   - after that, datasets only grow, by whole chunks, in an order of writes of which every prefix is a valid file (sim/ordered_file.h);
//   - superblock version 1 and object headers of version 1: no checksums and no "open for writing" mark, so no field depends on the bytes of another;
//   - the extents of datasets that lie in one page change in one write: for a single tool all datasets of length S together, and all of length K or P. S is
//     written first and may be one flush ahead of the others; with several tools the datasets of one length may lie in two pages and differ by a flush.
// A reader of a file whose writer was killed or is still writing takes the least S, K and P, and only the frames whose step is below S. After a failed write
// (full disk, full index) nothing more is written; the file stays as the last flush left it.
//
// Two kinds. A run's (`run --record`; recording_default_options) is exact: every value as the simulator has it. A session's (`nav`; recording_session_options)
// is small: commands, times, state hashes and integers are exact, so that each step can be simulated again bit for bit; the other values are rounded, to
// multiples of 2^-14 in step figures (mm, N, N mm; the residual to 8 bits) and of 2^-7 mm, 2^-9 (quaternions) and 2^-11 N in frames. Frames are stored every
// second; between them /motion holds poses (P) every 10 ms. For each dataset X of the frames, /motion/X holds integers: the change since the previous pose (the
// first: since zero) minus the change of the previous node, in the unit given by the file's attribute motion_length_mm (position, gap_mm, s_mm), motion_turn
// (quaternion), motion_force_n or motion_radius_mm, else 1. 0, -1, 1, -2, 2 … are stored as 0, 1, 2, 3, 4 …, and the last two dimensions are exchanged: (P,M,3)
// becomes (P,3,M). With h5py:
//   c = file["/motion/wire/position"][:].astype("i8")
//   position = numpy.cumsum((c >> 1) ^ -(c & 1), axis=-1).cumsum(axis=0).swapaxes(1, 2) * file.attrs["motion_length_mm"]
// Values beyond 2^30 units are infinite; nodes that do not exist (beyond /wire/count) repeat another node; /motion/wire/step is the row itself.
//
// Rows: /time_s (S) time at the end of each step, /command (S,2), /proximal (S,2), /state_hash (S), /inserted_mm (S), /released (S) 1 while the tool
// is released, /xray (S,19: sim/xray.h; 17 in recordings from before it was recorded what the window showed, 16 from before contrast agent had a tool), /report/penetration_mm, contacts (with force),
// iterations and residual of the contact solve, linearisations (1 in a quiet step), flags (all S), wall_force_n (S,2): largest and sum; frames:
// /wire/step (K) the row of the frame, /wire/position (K,M,3), /wire/quaternion (K,M,4) as w x y z, /contact/force_n (K,M,3), /contact/gap_mm (K,M),
// /contact/vessel_node (K,M); once: /wire/s_mm (M), /wire/radius_mm (M), /scene (text; attributes path, contact, files, sha256, of a session trainee
// and date, UTC as in its session file). Several tools: /wire and /contact are those of the shared centreline, whose number of nodes changes. M is
// the largest possible number, /wire/count (K) the actual one; the rows beyond hold NaN (vessel_node -1), and /wire/s_mm and radius_mm are (K,M).
// Tool N, 0 the outermost, has a group /tools/N with the attributes name and kind,
//   rows: command (S,2), proximal (S,2), inserted_mm (S), released (S); of tool 0 they are links to those at the root;
//   frames of its own nodes, inside other tools and behind the hub too: position (K,MN,3), quaternion (K,MN,4), carrier (K,MN) the outermost tool there, -1 in the
//   sheath or behind the hub; once: s_mm (MN), radius_mm (MN).
// If the scene has tools to exchange, /exchange (S,T,2) holds, for each of the T tools in every step, the device requested and the device inserted (0 the
// scene's, 1, 2, … those under its `exchange:`). MN is the largest number of nodes of its D devices, and s_mm and radius_mm are (D,MN); values beyond a
// device's nodes are NaN, in the frames too (carrier -1).
#ifndef SELDINGER_SIM_RECORDING_H
#define SELDINGER_SIM_RECORDING_H

#include "sim/simulator.h"
#include "sim/xray.h"
#include "sim/xray_tube.h"

typedef struct RecordingOptions {
    double frame_ms;         // simulated time between frames, default 10
    double pose_ms;          // > 0 for a session: simulated time between its poses (/motion), some of which are frames; values are rounded.
                             // Default 0: everything is exact
    double flush_s;          // simulated time per chunk; flushes wait for whole chunks, and for at least half that time in wall time. Default 0.2
    const char *trainee, *date;      // of a session (session_date()), else NULL
    const XrayPatient *patient;      // for the dose of a session, else NULL
    int64_t expected_steps;  // determines the size of the chunks and of their index; 0 or 1: unknown, at most 14 hours
    int file_count;          // number of further files that the run depends on, in addition to those of the scene
    const char *const *file;
} RecordingOptions;
RecordingOptions recording_default_options(void);    // for a run: every value exact
RecordingOptions recording_session_options(void);    // for a trainer session: poses at 100 Hz, frames at 1 Hz, at most 200 MB per hour with 120 nodes

// Values of /motion are within this many units of zero.
#define MOTION_MOST 1073741824.0

typedef struct Recording Recording;

// To be called before the first use of HDF5 in a program that records: after a full disk the library must not write at exit.
void recording_prepare_process(void);
// Returns NULL with a fault if the file cannot be created.
Recording *recording_create(const char *path, Simulator *simulator, const RecordingOptions *options, Faults *faults);
// To be called after each step. Makes no allocation and no file access; waits if the disk is slower than the simulation. `xray` may be NULL (a run without a
// viewer); injections by its script are recorded in any case. Returns false once writing has failed.
bool recording_step(Recording *recording, Simulator *simulator, const ToolCommands *commands, const XrayControl *xray);
// Adds the last state as a frame (in a session, as a pose), writes the rest and closes. Always frees. Returns false with a fault if writing failed.
bool recording_close(Recording *recording, Simulator *simulator, Faults *faults);
// Closes and removes the file. NULL is allowed.
void recording_abandon(Recording *recording);

// --- reading, for export, info and comparison ---
typedef struct RecordedTool {
    char name[TOOL_NAME_SIZE];       // "" if the file has none: a single tool
    char kind[TOOL_NAME_SIZE];
    double *command;         // the first tool's are those of the run
    double *proximal;        // (S, 2)
    double *inserted;        // (S) [mm]
    uint8_t *released;       // (S)
    double *turned;          // (S) [deg] since the start, the sum of the commands
    // with several tools only
    int node_count;          // N, the largest number of nodes of its devices
    int device_count;        // D, 1 if it could not be exchanged
    int device_nodes[1 + EXCHANGES_MOST];    // (D) node count of each device
    Vec3 *position;          // (K, N)
    Quat *quaternion;        // (K, N)
    int8_t *carrier;         // (K, N)
    double *s, *radius;      // (D, N) [mm]
} RecordedTool;

typedef struct RecordedRun {
    int64_t step_count;      // S
    double *time_s;          // (S)
    double *command;         // (S, 2) of the first tool
    double *proximal;        // (S, 2)
    uint64_t *state_hash;    // (S)
    int tool_count;          // outermost first
    RecordedTool tool[STEP_TOOLS_MAX];
    uint8_t *exchange;       // (S, tool_count, 2) device requested, device inserted; NULL: no tool could be exchanged
    int64_t frame_count;     // K
    int node_count;          // M, with several tools the largest possible number
    int64_t *frame_step;     // (K)
    int32_t *frame_nodes;    // (K) nodes in use; NULL: all
    Vec3 *position;          // (K, M)
    Quat *quaternion;        // (K, M)
    float *force;            // (K, M, 3) [N] from the wall
    float *gap;              // (K, M) [mm]
    int32_t *vessel_node;    // (K, M)
    double *inserted;        // (S) [mm]
    XrayControl *xray;       // (S); NULL in older recordings
    uint32_t *flags;         // (S) STEP_ flags
    double *wall_force;      // (S, 2) [N] largest and sum
    double *s, *radius;      // (M) [mm], of several tools (K, M)
    char *scene_text, *scene_path;   // NULL if the file does not hold them
    char *trainee, *date;    // of a session; else NULL
    char *files, *sha256;    // paths and checksums of the run's input files, one per line
    ContactKind contact;     // CONTACT_COUNT: not given, the scene's
    double step_ms;
} RecordedRun;
// Returns NULL with faults if the file is not a recording or its sizes are inconsistent.
RecordedRun *recorded_run_load(const char *path, Faults *faults);
// The same without frames and nodes, whose counts are 0 (an hour takes 0.6 GB instead of 2).
RecordedRun *recorded_run_load_series(const char *path, Faults *faults);
void recorded_run_free(RecordedRun *run);
// The centreline in a frame: pointers into the run.
typedef struct RecordedFrame {
    int node_count;
    const double *s, *radius;
    const Vec3 *position;
    const Quat *quaternion;
    const float *force, *gap;        // (node_count, 3), (node_count)
    const int32_t *vessel_node;
} RecordedFrame;
RecordedFrame recorded_run_frame(const RecordedRun *run, int64_t frame);
// A tool's own nodes in a frame; with several tools only.
typedef struct RecordedToolFrame {
    int node_count;
    const double *s, *radius;
    const Vec3 *position;
    const Quat *quaternion;
    const int8_t *carrier;
} RecordedToolFrame;
RecordedToolFrame recorded_run_tool_frame(const RecordedRun *run, int tool, int64_t frame);
int recorded_run_fitted(const RecordedRun *run, int tool, int64_t step);     // device inserted at that step
ToolCommands recorded_run_commands(const RecordedRun *run, int64_t step);
// Whether the run had a viewer: its steps have X-ray controls (`nav`). Otherwise (`run --record`) moving without X-ray is not an error.
bool recorded_run_was_watched(const RecordedRun *run);

#endif
