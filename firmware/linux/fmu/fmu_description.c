/* firmware/linux/fmu/fmu_description.c - see fmu_description.h.
 *
 * Both versions have the same parts in the same order: units, variables, then
 * which of the variables are outputs.  2.0 numbers variables by their place, 3.0
 * by their value reference.  Source: FMI 2.0.4, 2.2; FMI 3.0.1, 2.4. */
#include "firmware/linux/fmu/fmu_description.h"

#include <ctype.h>
#include <math.h>
#include <string.h>

#include "firmware/library/version.h"
#include "firmware/linux/fmu/fmu_model.h"

#define PI 3.14159265358979323846

struct describe {
    FILE *file;
    const struct rig *rig;
    int version;
};

static void describe_text(FILE *file, const char *text)
{
    for (; *text != '\0'; text++)
        switch (*text) {
        case '&':
            fputs("&amp;", file);
            break;
        case '<':
            fputs("&lt;", file);
            break;
        case '"':
            fputs("&quot;", file);
            break;
        default:
            fputc(*text, file);
        }
}

/* --- units --- */

/* A length in m, an angle in rad, or counts, which are in neither. */
static void describe_base(const struct describe *self, enum units_axis unit,
                          int per_s)
{
    static const double factor[UNITS_AXIS_WORDS] = {
        [UNITS_AXIS_MM] = 0.001,
        [UNITS_AXIS_DEG] = PI / 180,
        [UNITS_AXIS_REV] = 2 * PI,
        [UNITS_AXIS_RAD] = 1,
    };
    if (unit >= UNITS_AXIS_COUNT)
        return;
    fprintf(self->file, "      <BaseUnit %s=\"1\"",
            unit == UNITS_AXIS_MM ? "m" : "rad");
    if (per_s > 0)
        fprintf(self->file, " s=\"-%d\"", per_s);
    fprintf(self->file, " factor=\"%.17g\"/>\n", factor[unit]);
}

static void describe_unit_name(FILE *file, enum units_axis axis,
                               enum fmu_unit unit)
{
    static const char *const per[] = { "", "/s", "/s2" };
    if (unit == FMU_UNIT_RATE)
        fputs("rad/s", file);
    else if (unit <= FMU_UNIT_ACCELERATION)
        fprintf(file, "%s%s", units_axis_text(axis), per[unit]);
}

static bool describe_is_used(const struct describe *self, enum units_axis unit)
{
    for (unsigned i = 0; i < self->rig->axis_count; i++)
        if (self->rig->axis[i].unit == unit)
            return true;
    return false;
}

static void describe_units(const struct describe *self)
{
    fputs("  <UnitDefinitions>\n", self->file);
    if (self->version == 3)
        fputs("    <Unit name=\"s\">\n      <BaseUnit s=\"1\"/>\n    </Unit>\n",
              self->file);
    if (!describe_is_used(self, UNITS_AXIS_RAD))
        fputs(
            "    <Unit name=\"rad/s\">\n      <BaseUnit rad=\"1\" s=\"-1\"/>\n"
            "    </Unit>\n",
            self->file);
    for (unsigned u = 0; u < UNITS_AXIS_WORDS; u++) {
        if (!describe_is_used(self, (enum units_axis)u))
            continue;
        for (unsigned per = 0; per <= FMU_UNIT_ACCELERATION; per++) {
            fputs("    <Unit name=\"", self->file);
            describe_unit_name(self->file, (enum units_axis)u,
                               (enum fmu_unit)per);
            fputs("\">\n", self->file);
            describe_base(self, (enum units_axis)u, (int)per);
            fputs("    </Unit>\n", self->file);
        }
    }
    fputs("  </UnitDefinitions>\n", self->file);
}

/* --- variables --- */

/* "pan.enabled", or "'my-axis'.enabled" where it is no identifier; Source: FMI
 * 2.0.4, 2.2.9. */
static void describe_name(const struct describe *self, unsigned axis,
                          const char *of)
{
    const char *const name = self->rig->axis[axis].name;
    bool plain = isalpha((unsigned char)name[0]) || name[0] == '_';
    for (const char *at = name; *at != '\0'; at++)
        plain = plain && (isalnum((unsigned char)*at) || *at == '_');
    fputs(plain ? "" : "'", self->file);
    describe_text(self->file, name);
    fprintf(self->file, "%s.%s", plain ? "" : "'", of);
}

static double describe_start(const struct rig_axis *axis, enum fmu_of_axis of)
{
    switch (of) {
    case FMU_DEMAND_POSITION:
    case FMU_START_POSITION:
        return ldexp((double)axis->sim.start_q32, -32);
    case FMU_BANDWIDTH:
        return axis->sim.omega_mrad_s / 1000.0;
    case FMU_DAMPING:
        return axis->sim.zeta_permille / 1000.0;
    default:
        return 0;
    }
}

/* The attributes that both versions have for a variable. */
static void describe_attributes(const struct describe *self, unsigned axis,
                                enum fmu_of_axis of)
{
    static const char *const causality[] = { "parameter", "input", "output" };
    const struct fmu_variable *const variable = &fmu_of_axis[of];
    const bool is_real = variable->unit != FMU_UNIT_BOOLEAN;
    fputs(" name=\"", self->file);
    describe_name(self, axis, variable->name);
    fprintf(self->file,
            "\" valueReference=\"%u\" causality=\"%s\" variability=\"%s\" "
            "description=\"%s\"",
            fmu_reference(axis, of), causality[variable->causality],
            variable->causality == FMU_PARAMETER ? "fixed"
            : is_real                            ? "continuous"
                                                 : "discrete",
            variable->description);
}

static void describe_value(const struct describe *self, unsigned axis,
                           enum fmu_of_axis of)
{
    const struct fmu_variable *const variable = &fmu_of_axis[of];
    if (variable->unit < FMU_UNIT_NONE) {
        fputs(" unit=\"", self->file);
        describe_unit_name(self->file, self->rig->axis[axis].unit,
                           variable->unit);
        fputs("\"", self->file);
    }
    if (variable->causality != FMU_OUTPUT)
        fprintf(self->file, " start=\"%.17g\"",
                describe_start(&self->rig->axis[axis], of));
}

static void describe_variable(const struct describe *self, unsigned axis,
                              enum fmu_of_axis of)
{
    const bool is_real = fmu_of_axis[of].unit != FMU_UNIT_BOOLEAN;
    if (self->version == 2) {
        fputs("    <ScalarVariable", self->file);
        describe_attributes(self, axis, of);
        fprintf(self->file, ">\n      <%s", is_real ? "Real" : "Boolean");
        describe_value(self, axis, of);
        fputs("/>\n    </ScalarVariable>\n", self->file);
    } else {
        fprintf(self->file, "    <%s", is_real ? "Float64" : "Boolean");
        describe_attributes(self, axis, of);
        describe_value(self, axis, of);
        fputs("/>\n", self->file);
    }
}

#define ENABLE_TEXT "every drive has torque; from false to true clears faults"

static void describe_variables(const struct describe *self)
{
    fputs("  <ModelVariables>\n", self->file);
    if (self->version == 2)
        fprintf(self->file,
                "    <ScalarVariable name=\"enable\" valueReference=\"%d\" "
                "causality=\"input\" variability=\"discrete\" "
                "description=\"" ENABLE_TEXT "\">\n"
                "      <Boolean start=\"true\"/>\n    </ScalarVariable>\n",
                FMU_ENABLE);
    else
        fprintf(self->file,
                "    <Float64 name=\"time\" valueReference=\"%d\" "
                "causality=\"independent\" variability=\"continuous\" "
                "description=\"simulation time\" unit=\"s\"/>\n"
                "    <Boolean name=\"enable\" valueReference=\"%d\" "
                "causality=\"input\" variability=\"discrete\" "
                "description=\"" ENABLE_TEXT "\" start=\"true\"/>\n",
                FMU_TIME, FMU_ENABLE);
    for (unsigned i = 0; i < self->rig->axis_count; i++)
        for (unsigned of = 0; of < FMU_AXIS_VARIABLES; of++)
            describe_variable(self, i, (enum fmu_of_axis)of);
    fputs("  </ModelVariables>\n", self->file);
}

/* --- structure --- */

static void describe_outputs(const struct describe *self, const char *element)
{
    for (unsigned i = 0; i < self->rig->axis_count; i++)
        for (unsigned of = 0; of < FMU_AXIS_VARIABLES; of++) {
            if (fmu_of_axis[of].causality != FMU_OUTPUT)
                continue;
            if (self->version == 3)
                fprintf(self->file, "    <%s valueReference=\"%u\"/>\n",
                        element, fmu_reference(i, (enum fmu_of_axis)of));
            else /* enable is the first */
                fprintf(self->file, "      <%s index=\"%u\"/>\n", element,
                        2 + i * FMU_AXIS_VARIABLES + of);
        }
}

static void describe_structure(const struct describe *self)
{
    fputs("  <ModelStructure>\n", self->file);
    if (self->version == 3) {
        describe_outputs(self, "Output");
        describe_outputs(self, "InitialUnknown");
    } else {
        fputs("    <Outputs>\n", self->file);
        describe_outputs(self, "Unknown");
        fputs("    </Outputs>\n    <InitialUnknowns>\n", self->file);
        describe_outputs(self, "Unknown");
        fputs("    </InitialUnknowns>\n", self->file);
    }
    fputs("  </ModelStructure>\n", self->file);
}

void fmu_describe(FILE *file, const struct rig *rig, int version,
                  const char *token)
{
    const struct describe self = { file, rig, version };

    fprintf(file,
            "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
            "<fmiModelDescription fmiVersion=\"%s\" modelName=\"",
            version == 3 ? "3.0" : "2.0");
    describe_text(file, rig->title[0] != '\0' ? rig->title : "rig");
    fprintf(file,
            "\" %s=\"%s\" generationTool=\"slew " SLEW_VERSION "\" "
            "variableNamingConvention=\"structured\"%s>\n",
            version == 3 ? "instantiationToken" : "guid", token,
            version == 3 ? "" : " numberOfEventIndicators=\"0\"");
    fprintf(file,
            "  <CoSimulation modelIdentifier=\"" FMU_IDENTIFIER "\" "
            "canHandleVariableCommunicationStepSize=\"true\" %s/>\n",
            version == 3 ? "canGetAndSetFMUState=\"true\" "
                           "canSerializeFMUState=\"true\""
                         : "canNotUseMemoryManagementFunctions=\"true\" "
                           "canGetAndSetFMUstate=\"true\" "
                           "canSerializeFMUstate=\"true\"");
    describe_units(&self);
    fprintf(file,
            "  <DefaultExperiment startTime=\"0\" stopTime=\"10\" "
            "stepSize=\"%.9g\"/>\n",
            1e-9 * (double)rig->period_ns);
    describe_variables(&self);
    describe_structure(&self);
    fputs("</fmiModelDescription>\n", file);
}
