// What the page needs of files and addresses.

export { givenModel, pagePresets, type Presets, type Settings, settingsOf } from "./defaults";
export { semiAxes } from "./hertz";
export { allows, type Limit, type Limits, limitText, pageLimits } from "./limits";
export { type Model, ModelError, readModel, type Runs, writeModel } from "./model_file";
export { decimal, UNITS } from "./reading";
export { settingLimit } from "./setting_limits";
export { fromAddress, type FromAddress, toAddress } from "./settings";
