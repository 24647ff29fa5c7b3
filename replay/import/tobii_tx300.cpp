// Tobii TX300 through MATLAB, as in dcnieho/I2MC_Python: TSV with 3D eye and gaze positions.
//
// Time: microseconds. Positions: millimetres in Tobii's user coordinates, +x right, +y up, +z towards the person, which
// are our axes already. Known from the files: REyePos3dx exceeds LEyePos3dx by 44 mm; GazePos3dy falls as GazePos2dy
// (0 at the top) rises; the eyes' z is about 600 mm, that of the screen 50 to 60. The direction is gaze point minus eye.
// Validity: 0 certain ... 4 lost; above 1 the eye may be the other one (Tobii SDK). Lost values are 0 or -1.
#include "replay/import/conventions.hpp"
#include "replay/import/importer.hpp"
#include "replay/import/text_table.hpp"

namespace fovea::replay {
namespace {

struct EyeColumns {
    std::size_t eye[3], gaze[3], pupil, validity;
};

EyeColumns eye_columns(TextTable& t, const std::string& side) {
    return {{t.need(side + "EyePos3dx"), t.need(side + "EyePos3dy"), t.need(side + "EyePos3dz")},
            {t.need(side + "GazePos3dx"), t.need(side + "GazePos3dy"), t.need(side + "GazePos3dz")},
            t.need(side + "PupilDm"),
            t.need(side + "Validity")};
}

void read_eye(TextTable& t, const EyeColumns& c, EyeState& eye) {
    const double validity = t.need_number(c.validity), pupil = t.number(c.pupil);
    if (validity < 0 || validity > 4) t.fail_at(c.validity, "is not between 0 (certain) and 4 (lost)", "mend the line");
    double d[3];
    for (int i = 0; i < 3; ++i) d[i] = t.number(c.gaze[i]) - t.number(c.eye[i]);
    if (validity <= 1) {
        set_gaze(eye, Direction<HeadFrame>::from({d[0], d[1], d[2]}));
        if (eye.valid && d[2] >= 0)
            t.fail_at(c.gaze[2], "the gaze point lies behind the eye", "positions must be in Tobii's user coordinates");
        if (pupil > 0) eye.pupil_mm = pupil;
    }
}

}  // namespace

bool recognise_tobii_tx300(std::string_view prefix) {
    const std::string_view header = first_line(prefix);
    return has_cell(header, '\t', "LGazePos3dx") && has_cell(header, '\t', "LEyePos3dx");
}

Result<Recording> read_tobii_tx300(const ImportInput& input) {
    TextTable table(input.path, input.content, '\t');
    if (!table.read_header()) return table.error();
    const std::size_t time = table.need("Time");
    const EyeColumns left = eye_columns(table, "L"), right = eye_columns(table, "R");
    Recording recording{{"tobii_tx300", "Tobii TX300", "", "", 0, false, false}, {}};
    while (table.next_row()) {
        RecordedSample r;
        r.sample.id = recording.samples.size() + 1;
        r.sample.device_time.ns = table.need_time_ns(time, -6);
        r.sample.exposed = r.sample.received = instant_from_ns(r.sample.device_time.ns);
        read_eye(table, left, r.sample.eye(Eye::left));
        read_eye(table, right, r.sample.eye(Eye::right));
        combine_eyes(r.sample);
        recording.samples.push_back(r);
    }
    if (table.failed()) return table.error();
    recording.info.nominal_rate_hz = measured_rate_hz(recording);
    return recording;
}

}  // namespace fovea::replay
