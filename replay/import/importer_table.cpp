#include "replay/import/importer.hpp"

namespace fovea::replay {

const std::vector<Importer>& importers() {
    static const std::vector<Importer> table = {
        {"session", "Fovea's session file, .fovea (docs/session_file.md)", recognise_session, read_session, true},
        {"fovea_csv", "Fovea's own CSV (docs/recording_csv.md)", recognise_fovea_csv, read_fovea_csv, false},
        {"numpy", "NumPy .npy, structured array t, x, y, status, evt in degrees (irf lookAtPoint_EL)", recognise_numpy,
         read_numpy, false},
        {"vive_sranipal", "HTC Vive Pro Eye, SRanipal CSV with helmet rotation", recognise_vive_sranipal,
         read_vive_sranipal, false},
    };
    return table;
}

}  // namespace fovea::replay
