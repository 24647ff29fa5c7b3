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
        {"eyelink_asc", "SR Research EyeLink .asc (also .gz): gaze or href samples, parser events as labels",
         recognise_eyelink_asc, read_eyelink_asc, false},
        {"pupil_core", "Pupil Core gaze_positions.csv (3D)", recognise_pupil_core, read_pupil_core, false},
        {"pupil_cloud", "Pupil Invisible and Neon gaze.csv (Pupil Cloud), fixation and blink ids as labels",
         recognise_pupil_cloud, read_pupil_cloud, false},
        {"tobii_glasses2", "Tobii Pro Glasses 2 livedata.json (also .gz)", recognise_tobii_glasses2,
         read_tobii_glasses2, false},
        {"tobii_glasses3", "Tobii Pro Glasses 3 gazedata (also .gz)", recognise_tobii_glasses3, read_tobii_glasses3,
         false},
        {"tobii_pro_lab", "Tobii Pro Lab TSV export with gaze directions or DACS positions", recognise_tobii_pro_lab,
         read_tobii_pro_lab, false},
        {"tobii_tx300", "Tobii TX300 TSV with 3D eye and gaze positions (I2MC)", recognise_tobii_tx300,
         read_tobii_tx300, false},
        {"jov2023", "HTC Vive Pro Eye in Unity: *_gaze.csv, with *_head.csv beside it", recognise_jov2023, read_jov2023,
         false},
        {"pico_neo3", "Pico Neo 3 Pro Eye TSV", recognise_pico_neo3, read_pico_neo3, false},
        {"etdqualitizer", "ETDQualitizer TSV: pixels from the centre of a 528 x 297 mm screen at 650 mm",
         recognise_etdqualitizer, read_etdqualitizer, false},
        {"oemc_hmr", "OEMC HMR eye_0.csv: pupil positions, uncalibrated, nominal scale", recognise_oemc_hmr,
         read_oemc_hmr, false},
        {"xdf", "LSL .xdf, first stream of type Gaze with directions", recognise_xdf, read_xdf, false},
    };
    return table;
}

}  // namespace fovea::replay
