# Sample of drives that bench/outside/run.sh measures; sourced by it.
# shellcheck shell=bash disable=SC2034
#
# A line is a drive of every seed: groups, scene, LiDAR, options of `unimapper simulate`, with bars
# between. Each target has a group; every scene meets several LiDARs, every option several scenes.
# Drives of the groups in $refined_groups are refined by the merger, too.
refined_groups="square spinning narrow mid vlp kitti"
sample() {
  cat <<'SAMPLE'
own,spinning|town|os2-128|
own,spinning|town|os1-64|
own,spinning|town|hdl-64e|
poles|town|os2-128|--columns 256
poles|town|os2-128|--columns 512
poles|town|os2-128|--columns 2048
poles|town|os2-128|--rings 16
poles|town|os2-128|--rings 32 --uneven-rings
poles|town|os2-128|--columns 512 --rings 64
poles|town|os1-64|--columns 512
poles|town|hdl-64e|--rings 32 --columns 1024
own,street,spinning|street|os2-128|
own,street,spinning|street|os1-64|
own,street,spinning|street|hdl-64e|
street|street|vlp-16|
poles|street|os2-128|--columns 512
poles|street|os1-64|--columns 256 --rings 32
poles|street|os1-64|--rings 64 --uneven-rings
deck|deck|vlp-16|
deck|deck|os1-64|
deck|deck|os2-128|
deck|deck|os2-128|--rings 32
deck|deck|os1-64|--columns 512 --rings 16 --uneven-rings
deck|deck|hdl-64e|--columns 1024
square|square|os2-128|
square|square|os1-64|
square|square|hdl-64e|
square|square|vlp-16|
narrow|town|livox-avia|
narrow|town|aeva-aeries2|
mid|town|livox-mid-360|
vlp|town|vlp-16|
others|convoy|os1-64|
others|convoy|livox-avia|
others|convoy|vlp-16|--columns 512
others|tunnel|os1-64|
others|tunnel|vlp-16|
others|hall|os1-64|
others|hall|livox-mid-360|
others|campus|os1-64|--columns 512 --sway 5@2
others|campus|vlp-16|--distortion
others|town|os1-64|--attitude-noise 0.5
others|town|hdl-64e|--mount-pitch 12 --odometry-start identity --points body
others|deck|vlp-16|--mount-roll 8 --odometry-start identity --distortion
others|street|livox-mid-360|
others|square|livox-avia|--attitude-noise 0.5@2
SAMPLE
}

# Recordings, where they lie beside the project; their only option is noise that is added here.
recorded_sample() {
  cat <<'SAMPLE'
kitti|kitti|hdl-64e|
noise|kitti|hdl-64e|--attitude-noise 0.5
noise|kitti|hdl-64e|--attitude-noise 0.5@2
SAMPLE
}

# Mounted LiDARs whose odometry starts at identity: scene, LiDAR, roll, pitch.
mounted_sample() {
  cat <<'SAMPLE'
town|os1-64|5|-3
campus|os1-64|-8|6
town|vlp-16|4|14
campus|vlp-16|-2|10
town|livox-mid-360|0|0
campus|livox-mid-360|7|-7
town|livox-avia|-6|5
campus|livox-avia|0|12
SAMPLE
}

# Pairs of drives through one scene: scene, LiDAR, roll and pitch of A, then of B; 0 0: level.
pairs_sample() {
  cat <<'SAMPLE'
town|os1-64|0|0|vlp-16|0|0
town|os1-64|-3|6|vlp-16|5|-10
town|os1-64|10|-11|vlp-16|0|0
campus|os1-64|0|0|livox-avia|0|10
SAMPLE
}

# Targets: title, figure, labels (online, refined), comparison, goal, groups of drives.
targets() {
  cat <<'TARGETS'
poles and signs, 256 to 2,048 columns, 16 to 128 rings: SA|poles|online|>=|96|poles own
the same drives: AA below that in the LiDAR's own mode|loss|online|<=|1|poles
ceiling of 2.5 to 3.5 m: SA of the building|ceiling|online|>=|99|deck
walkers below it: DA|walkers|online|>=|90|deck
walkers 0.2 to 0.5 m from surfaces seen first with them: DA|walkers|online|>=|80|street
parked trucks beside traffic: SA|trucks|online|>=|99|street
crowded square: AA online|AA|online|>=|97|square
crowded square: AA refined|AA|refined|>=|98.5|square
street and town, 64 and 128 rings: AA online|AA|online|>=|97.5|spinning
street and town, 64 and 128 rings: AA refined|AA|refined|>=|99|spinning
Avia and Aeva in the town: AA online|AA|online|>=|97|narrow
Avia and Aeva in the town: AA refined|AA|refined|>=|98|narrow
Mid-360 in the town: AA online|AA|online|>=|92|mid
Mid-360 in the town: AA refined|AA|refined|>=|96|mid
Mid-360 in the town: SA online|SA|online|>=|98|mid
VLP-16 in the town: AA online|AA|online|>=|94|vlp
VLP-16 in the town: AA refined|AA|refined|>=|97|vlp
KITTI 0005 with attitude noise of 0.5°: SA|SA|online|>=|98|noise
KITTI 0005: AA|AA|online|>=|99.7|kitti
object classes of a drive whose refined SA or DA is more than 0.2 below online|below|refined|<=|0|square spinning narrow mid vlp kitti
TARGETS
}
