"""The public names, by group; docs/reference/api.md states what is stable about them.

``__init__.py`` reads this list: each line names one module and one name in it.
"""

# ruff: isort: skip_file

__version__: str

# Studies
from polychirp.study.spec import Study as Study
from polychirp.study.spec import StudyRadar as StudyRadar
from polychirp.study.traffic import StudyTraffic as StudyTraffic
from polychirp.config.load import load_study as load_study
from polychirp.config.dump import dump as dump
from polychirp.study.check import check as check
from polychirp.study.check import Derived as Derived
from polychirp.study.paper.scenarios import paper_study as paper_study

# Runs
from polychirp.study.trial import run_trial as run_trial
from polychirp.study.trial import Trial as Trial
from polychirp.study.trial import VictimResult as VictimResult
from polychirp.study.provenance import provenance as provenance
from polychirp.study.provenance import Provenance as Provenance
from polychirp.study.store.save import save_run as save_run
from polychirp.study.store.load import load_run as load_run
from polychirp.study.store.load import StoredRun as StoredRun
from polychirp.study.store.load import StoredVictim as StoredVictim
from polychirp.study.paper.scenarios import run_paper as run_paper

# Many trials
from polychirp.config.monte_carlo import load_plan as load_plan
from polychirp.study.monte_carlo.plan import Plan as Plan
from polychirp.study.monte_carlo.run import run_plan as run_plan
from polychirp.study.monte_carlo.run import Finished as Finished
from polychirp.study.monte_carlo.executor import LocalWorkers as LocalWorkers
from polychirp.study.monte_carlo.results import load_results as load_results
from polychirp.study.monte_carlo.results import Results as Results
from polychirp.study.monte_carlo.summary import summaries as summaries
from polychirp.study.monte_carlo.summary import Summary as Summary
from polychirp.scoring.statistics import Estimate as Estimate
from polychirp.study.roc.plan import roc_plan as roc_plan
from polychirp.study.roc.plan import RocPlan as RocPlan
from polychirp.study.roc.run import run_roc as run_roc
from polychirp.study.roc.run import RocResult as RocResult

# Streets
from polychirp.traffic.street import Street as Street
from polychirp.traffic.street import Vehicle as Vehicle
from polychirp.traffic.street import Building as Building
from polychirp.traffic.street import Tree as Tree
from polychirp.traffic.street import Road as Road
from polychirp.traffic.street import Point as Point
from polychirp.traffic.road_users import Pedestrian as Pedestrian
from polychirp.traffic.road_users import Bicycle as Bicycle
from polychirp.traffic.road_users import Motorcycle as Motorcycle
from polychirp.traffic.random_traffic import RandomTraffic as RandomTraffic
from polychirp.traffic.random_traffic import Lane as Lane
from polychirp.traffic.paper import paper_street as paper_street
from polychirp.traffic.vehicle import vehicle_mesh as vehicle_mesh
from polychirp.traffic.mesh_file import load_mesh as load_mesh
from polychirp.traffic.mesh_file import save_glb as save_glb
from polychirp.frames import Pose as Pose

# Waveforms
from polychirp.waveform.base import Waveform as Waveform
from polychirp.waveform.sawtooth import Sawtooth as Sawtooth
from polychirp.waveform.subframes import Subframes as Subframes
from polychirp.waveform.triangular import Triangular as Triangular
from polychirp.waveform.triangular import DiverseTriangular as DiverseTriangular
from polychirp.waveform.triangular import FixedTriangular as FixedTriangular
from polychirp.waveform.diverse_sawtooth import DiverseSawtooth as DiverseSawtooth
from polychirp.waveform.hopping import Hopping as Hopping
from polychirp.waveform.phase_codes import PhaseCodedSawtooth as PhaseCodedSawtooth
from polychirp.waveform.permuted_chirps import PermutedChirps as PermutedChirps
from polychirp.waveform.slope_sequence import SlopeSequence as SlopeSequence
from polychirp.waveform.phase_coded_ramp import PhaseCodedRamp as PhaseCodedRamp
from polychirp.waveform.pmcw import Pmcw as Pmcw
from polychirp.waveform.mfsk import Mfsk as Mfsk
from polychirp.waveform.noise import Noise as Noise
from polychirp.waveform.access import Access as Access
from polychirp.waveform.access import RandomStarts as RandomStarts
from polychirp.waveform.access import SlottedAloha as SlottedAloha
from polychirp.waveform.access import Slots as Slots
from polychirp.waveform.access import Compass as Compass
from polychirp.waveform.coding import Coding as Coding
from polychirp.waveform.coding import TimeDivision as TimeDivision
from polychirp.waveform.coding import DopplerDivision as DopplerDivision
from polychirp.waveform.coding import PhaseCoded as PhaseCoded
from polychirp.model.ramp import RampSchedule as RampSchedule
from polychirp.model.ramp_code import RampCode as RampCode
from polychirp.model.ramp import continuous_phase as continuous_phase
from polychirp.rng import Streams as Streams

# Radar hardware
from polychirp.model.radar import Radar as Radar
from polychirp.model.radar import Converter as Converter
from polychirp.model.antenna import AntennaArray as AntennaArray
from polychirp.model.antenna import ElementPattern as ElementPattern
from polychirp.model.antenna import ArrayErrors as ArrayErrors
from polychirp.model.if_filter import IfFilter as IfFilter
from polychirp.model.oscillator import Oscillator as Oscillator
from polychirp.model.oscillator import PhaseNoise as PhaseNoise
from polychirp.model.front_end import FrontEnd as FrontEnd
from polychirp.model.leakage import Leakage as Leakage
from polychirp.model.leakage import Bumper as Bumper

# Ray tracers and radar cross sections
from polychirp.channel.base import RayTracer as RayTracer
from polychirp.channel.tracers.composite import Composite as Composite
from polychirp.channel.tracers.free_space import FreeSpace as FreeSpace
from polychirp.channel.point_vehicles.tracer import PointVehicles as PointVehicles
from polychirp.channel.tracers.sionna import SionnaRt as SionnaRt
from polychirp.channel.rcs import cross_sections as cross_sections
from polychirp.channel.rcs import CrossSections as CrossSections

# Receivers and mitigation
from polychirp.receiver.selection import AutoReceiver as AutoReceiver
from polychirp.receiver.coherent.chain import CoherentReceiver as CoherentReceiver
from polychirp.receiver.range_doppler.chain import RangeDoppler as RangeDoppler
from polychirp.receiver.decoding.chain import Decoding as Decoding
from polychirp.receiver.stepped.chain import MfskReceiver as MfskReceiver
from polychirp.receiver.alternatives.paper_receiver import PaperReceiver as PaperReceiver
from polychirp.receiver.detection.cfar import CfarWindow as CfarWindow
from polychirp.receiver.mitigation.base import Mitigation as Mitigation
from polychirp.receiver.mitigation.blanking import Blanking as Blanking
from polychirp.receiver.mitigation.autoregression import Autoregression as Autoregression
from polychirp.receiver.mitigation.imat import Imat as Imat
from polychirp.receiver.mitigation.stft_excision import StftExcision as StftExcision
from polychirp.receiver.mitigation.interpolation import Interpolation as Interpolation
from polychirp.receiver.mitigation.burg import Burg as Burg
from polychirp.receiver.mitigation.matrix_pencil import MatrixPencil as MatrixPencil
from polychirp.receiver.mitigation.nulling import Nulling as Nulling
from polychirp.receiver.mitigation.stft_statistics import StftStatistics as StftStatistics
from polychirp.receiver.mitigation.dual_sparsity import DualSparsity as DualSparsity
from polychirp.receiver.mitigation.noise_canceller import NoiseCanceller as NoiseCanceller
from polychirp.receiver.mitigation.ramp_minimum import RampMinimum as RampMinimum
from polychirp.receiver.mitigation.low_rank_hankel import LowRankHankel as LowRankHankel
from polychirp.receiver.mitigation.complex_network import ComplexNetwork as ComplexNetwork
from polychirp.receiver.mitigation.wavelet import Wavelet as Wavelet
from polychirp.receiver.mitigation.chirp_subtraction import ChirpSubtraction as ChirpSubtraction

# Data of a run
from polychirp.model.scene import Scene as Scene
from polychirp.model.scene import Actor as Actor
from polychirp.model.mesh import Mesh as Mesh
from polychirp.model.mesh import Plate as Plate
from polychirp.model.paths import PropagationPaths as PropagationPaths
from polychirp.model.if_frame import IfFrame as IfFrame
from polychirp.model.if_frame import IfParts as IfParts
from polychirp.model.detection import Detections as Detections
from polychirp.model.truth import Truth as Truth
from polychirp.model.score import Score as Score
from polychirp.scoring.causes import Nature as Nature
from polychirp.axes import axes_of as axes_of

# Figures and exports
from polychirp.report.run_plots import draw as draw
from polychirp.report.run_plots import RunPlots as RunPlots
from polychirp.report.figures.study_curves import study_curves as study_curves
from polychirp.report.figures.drawing import Drawing as Drawing
from polychirp.exchange.formats import export as export

# Recordings and signals
from polychirp.capture.parameters import CaptureParameters as CaptureParameters
from polychirp.capture.ti_profile import recording_parameters as recording_parameters
from polychirp.capture.ti_stream import raw_parameters as raw_parameters
from polychirp.capture.recording import Recording as Recording
from polychirp.capture.recording import from_array as from_array
from polychirp.capture.recording import open_numpy as open_numpy
from polychirp.capture.dca1000 import open_raw as open_raw
from polychirp.model.baseband import Baseband as Baseband
from polychirp.waveform.playing import played as played
from polychirp.correlation.base import correlate as correlate
from polychirp.correlation.base import Correlation as Correlation

# Units
from polychirp.units import from_db as from_db
from polychirp.units import to_db as to_db

# Errors
from polychirp.errors import PolychirpError as PolychirpError
from polychirp.errors import InputError as InputError
from polychirp.errors import PhysicsError as PhysicsError
from polychirp.errors import CapabilityError as CapabilityError
from polychirp.errors import RunError as RunError
from polychirp.errors import ModelWarning as ModelWarning
