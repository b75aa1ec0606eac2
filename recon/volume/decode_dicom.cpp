// seldinger-dicom: decompresses the pixels of a DICOM image. It reads the file from standard input and writes the same image to standard output,
// uncompressed, in explicit little endian. It is a separate program because GDCM reads untrusted data here: the caller limits its memory and time
// (volume_dicom_pixels.c), and a crash is just another fault. GDCM reads JPEG (8 to 16 bits, also lossless), JPEG-LS, JPEG 2000 and RLE. Exit code 0 on
// success; 1 if the image cannot be read, 2 if its pixels cannot be decompressed, 3 if the result cannot be written.
#include <gdcmImageChangeTransferSyntax.h>
#include <gdcmImageReader.h>
#include <gdcmImageWriter.h>

#include <cstdio>
#include <sstream>
#include <sys/resource.h>

int main()
{
    try {
        gdcm::ImageReader reader;
        reader.SetFileName("/dev/stdin");
        if (!reader.Read())
            return 1;
        // forbid further files: GDCM's last resort (PVRG) leaves temporary files behind
        const rlimit files = {3, 3};
        setrlimit(RLIMIT_NOFILE, &files);
        gdcm::ImageChangeTransferSyntax change;
        change.SetTransferSyntax(gdcm::TransferSyntax::ExplicitVRLittleEndian);
        change.SetInput(reader.GetImage());
        if (!change.Change())
            return 2;
        std::ostringstream answer;
        gdcm::ImageWriter writer;
        writer.SetFile(reader.GetFile());
        writer.SetImage(change.GetOutput());
        writer.SetStream(answer);
        if (!writer.Write())
            return 2;
        const std::string bytes = answer.str();
        return std::fwrite(bytes.data(), 1, bytes.size(), stdout) == bytes.size() && std::fflush(stdout) == 0 ? 0 : 3;
    } catch (...) {     // usually out of memory
        return 2;
    }
}
