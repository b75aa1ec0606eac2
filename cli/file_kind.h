// Recognises the kind of a file by its content, not its name, for info and export.
#ifndef SELDINGER_CLI_FILE_KIND_H
#define SELDINGER_CLI_FILE_KIND_H

typedef enum { FILE_MISSING, FILE_UNKNOWN, FILE_TREE, FILE_RECORDING, FILE_SCENE, FILE_SCRIPT, FILE_VOLUME, FILE_SURFACE } FileKind;

// FILE_TREE stands for trees and models. A folder counts as a DICOM series.
FileKind file_kind(const char *path);

#endif
