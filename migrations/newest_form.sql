-- revision 0023
CREATE TABLE access_state (
	id VARCHAR NOT NULL, 
	revision INTEGER NOT NULL, 
	"key" VARCHAR NOT NULL, 
	CONSTRAINT pk_access_state PRIMARY KEY (id)
);

CREATE TABLE accounts (
	name VARCHAR NOT NULL, 
	role VARCHAR NOT NULL, 
	team VARCHAR NOT NULL, 
	password VARCHAR, 
	created_at DATETIME NOT NULL, 
	created_by VARCHAR NOT NULL, 
	CONSTRAINT pk_accounts PRIMARY KEY (name)
);

CREATE TABLE alembic_version (
	version_num VARCHAR(32) NOT NULL, 
	CONSTRAINT alembic_version_pkc PRIMARY KEY (version_num)
);

CREATE TABLE analysis_batches (
	id VARCHAR NOT NULL, 
	method VARCHAR NOT NULL, 
	version VARCHAR NOT NULL, 
	parameters JSON NOT NULL, 
	calibrations JSON NOT NULL, 
	selection JSON NOT NULL, 
	"each" VARCHAR NOT NULL, 
	priority INTEGER NOT NULL, 
	requested_by VARCHAR NOT NULL, 
	created_at DATETIME NOT NULL, 
	total INTEGER NOT NULL, 
	cancelled_at DATETIME, 
	cancelled_by VARCHAR NOT NULL, 
	ended_at DATETIME, 
	final_counts JSON, 
	CONSTRAINT pk_analysis_batches PRIMARY KEY (id)
);

CREATE TABLE analysis_task_recordings (
	batch_id VARCHAR NOT NULL, 
	number INTEGER NOT NULL, 
	position INTEGER NOT NULL, 
	recording_id VARCHAR NOT NULL, 
	CONSTRAINT pk_analysis_task_recordings PRIMARY KEY (batch_id, number, position), 
	CONSTRAINT fk_analysis_task_recordings_batch_id_analysis_tasks FOREIGN KEY(batch_id, number) REFERENCES analysis_tasks (batch_id, number), 
	CONSTRAINT fk_analysis_task_recordings_recording_id_recordings FOREIGN KEY(recording_id) REFERENCES recordings (id)
);

CREATE TABLE analysis_tasks (
	batch_id VARCHAR NOT NULL, 
	number INTEGER NOT NULL, 
	state VARCHAR NOT NULL, 
	priority INTEGER NOT NULL, 
	attempt INTEGER NOT NULL, 
	worker VARCHAR NOT NULL, 
	claimed_at DATETIME, 
	ended_at DATETIME, 
	not_before DATETIME, 
	result_id VARCHAR, 
	failure JSON, 
	CONSTRAINT pk_analysis_tasks PRIMARY KEY (batch_id, number), 
	CONSTRAINT fk_analysis_tasks_batch_id_analysis_batches FOREIGN KEY(batch_id) REFERENCES analysis_batches (id), 
	CONSTRAINT fk_analysis_tasks_result_id_results FOREIGN KEY(result_id) REFERENCES results (id)
);

CREATE TABLE approvals (
	procedure VARCHAR NOT NULL, 
	version VARCHAR NOT NULL, 
	"by" VARCHAR NOT NULL, 
	at DATETIME NOT NULL, 
	CONSTRAINT pk_approvals PRIMARY KEY (procedure)
);

CREATE TABLE audit (
	id VARCHAR NOT NULL, 
	at DATETIME NOT NULL, 
	who VARCHAR NOT NULL, 
	action VARCHAR NOT NULL, 
	target VARCHAR NOT NULL, 
	outcome VARCHAR NOT NULL, 
	detail JSON NOT NULL, sequence BIGINT, digest VARCHAR, 
	CONSTRAINT pk_audit PRIMARY KEY (id)
);

CREATE TABLE audit_checkpoints (
	last BIGINT NOT NULL, 
	first BIGINT NOT NULL, 
	first_at DATETIME NOT NULL, 
	last_at DATETIME NOT NULL, 
	"before" VARCHAR NOT NULL, 
	digest VARCHAR NOT NULL, 
	closed_at DATETIME NOT NULL, 
	closed_by VARCHAR NOT NULL, 
	CONSTRAINT pk_audit_checkpoints PRIMARY KEY (last)
);

CREATE TABLE bench_live (
	bench VARCHAR NOT NULL, 
	at DATETIME NOT NULL, 
	host VARCHAR NOT NULL, 
	process INTEGER NOT NULL, 
	job_id VARCHAR, 
	document JSON NOT NULL, 
	CONSTRAINT pk_bench_live PRIMARY KEY (bench)
);

CREATE TABLE bench_stops (
	id VARCHAR NOT NULL, 
	bench VARCHAR NOT NULL, 
	at DATETIME NOT NULL, 
	reason VARCHAR NOT NULL, 
	"by" VARCHAR NOT NULL, 
	safe_at DATETIME, 
	safe_by VARCHAR NOT NULL, 
	released_at DATETIME, 
	released_by VARCHAR NOT NULL, 
	remark VARCHAR NOT NULL, entered_at DATETIME, 
	CONSTRAINT pk_bench_stops PRIMARY KEY (id)
);

CREATE TABLE benches (
	id VARCHAR NOT NULL, 
	document JSON NOT NULL, 
	updated_at DATETIME NOT NULL, 
	CONSTRAINT pk_benches PRIMARY KEY (id)
);

CREATE TABLE calibration_decisions (
	id VARCHAR NOT NULL, 
	calibration_id VARCHAR NOT NULL, 
	act VARCHAR NOT NULL, 
	at DATETIME NOT NULL, 
	"by" VARCHAR NOT NULL, 
	proven BOOLEAN NOT NULL, 
	remark VARCHAR NOT NULL, 
	CONSTRAINT pk_calibration_decisions PRIMARY KEY (id), 
	CONSTRAINT fk_calibration_decisions_calibration_id_calibrations FOREIGN KEY(calibration_id) REFERENCES calibrations (id)
);

CREATE TABLE calibrations (
	id VARCHAR NOT NULL, 
	unit VARCHAR NOT NULL, 
	triad VARCHAR NOT NULL, 
	method VARCHAR NOT NULL, 
	origin VARCHAR NOT NULL, 
	result_id VARCHAR, 
	made_at DATETIME NOT NULL, 
	simulated BOOLEAN NOT NULL, 
	output_unit VARCHAR NOT NULL, 
	input_unit VARCHAR NOT NULL, 
	model VARCHAR NOT NULL, 
	correlations JSON NOT NULL, 
	is_current BOOLEAN NOT NULL, 
	by_rule BOOLEAN NOT NULL, 
	approval VARCHAR NOT NULL, 
	valid_from DATETIME, 
	valid_until DATETIME, 
	CONSTRAINT pk_calibrations PRIMARY KEY (id), 
	CONSTRAINT fk_calibrations_result_id_results FOREIGN KEY(result_id) REFERENCES results (id)
);

CREATE TABLE campaign_runs (
	id VARCHAR NOT NULL, 
	campaign VARCHAR NOT NULL, 
	unit VARCHAR NOT NULL, 
	bench VARCHAR NOT NULL, 
	state VARCHAR NOT NULL, 
	verdict VARCHAR, 
	created_at DATETIME NOT NULL, 
	finished_at DATETIME, 
	schedule_id VARCHAR, 
	document JSON NOT NULL, 
	CONSTRAINT pk_campaign_runs PRIMARY KEY (id)
);

CREATE TABLE campaigns (
	name VARCHAR NOT NULL, 
	document JSON NOT NULL, 
	created_at DATETIME NOT NULL, 
	updated_at DATETIME NOT NULL, team VARCHAR DEFAULT '' NOT NULL, 
	CONSTRAINT pk_campaigns PRIMARY KEY (name)
);

CREATE TABLE chunks (
	recording_id VARCHAR NOT NULL, 
	number INTEGER NOT NULL, 
	start_sample BIGINT NOT NULL, 
	samples INTEGER NOT NULL, 
	sha256 VARCHAR NOT NULL, 
	payload BLOB NOT NULL, 
	CONSTRAINT pk_chunks PRIMARY KEY (recording_id, number), 
	CONSTRAINT fk_chunks_recording_id_recordings FOREIGN KEY(recording_id) REFERENCES recordings (id)
);

CREATE TABLE coefficients (
	calibration_id VARCHAR NOT NULL, 
	position INTEGER NOT NULL, 
	name VARCHAR NOT NULL, 
	value FLOAT NOT NULL, 
	unit VARCHAR NOT NULL, 
	standard_uncertainty FLOAT NOT NULL, 
	CONSTRAINT pk_coefficients PRIMARY KEY (calibration_id, position), 
	CONSTRAINT fk_coefficients_calibration_id_calibrations FOREIGN KEY(calibration_id) REFERENCES calibrations (id)
);

CREATE TABLE correction_decisions (
	id VARCHAR NOT NULL, 
	correction_id VARCHAR NOT NULL, 
	act VARCHAR NOT NULL, 
	at DATETIME NOT NULL, 
	"by" VARCHAR NOT NULL, 
	proven BOOLEAN NOT NULL, 
	remark VARCHAR NOT NULL, 
	CONSTRAINT pk_correction_decisions PRIMARY KEY (id), 
	CONSTRAINT fk_correction_decisions_correction_id_corrections FOREIGN KEY(correction_id) REFERENCES corrections (id)
);

CREATE TABLE corrections (
	id VARCHAR NOT NULL, 
	unit VARCHAR NOT NULL, 
	kind VARCHAR NOT NULL, 
	result_id VARCHAR NOT NULL, 
	made_at DATETIME NOT NULL, 
	is_current BOOLEAN NOT NULL, 
	simulated BOOLEAN NOT NULL, 
	document JSON NOT NULL, approval VARCHAR DEFAULT 'open' NOT NULL, valid_until DATETIME, 
	CONSTRAINT pk_corrections PRIMARY KEY (id), 
	CONSTRAINT fk_corrections_result_id_results FOREIGN KEY(result_id) REFERENCES results (id)
);

CREATE TABLE events (
	job_id VARCHAR NOT NULL, 
	sequence INTEGER NOT NULL, 
	at DATETIME NOT NULL, 
	kind VARCHAR NOT NULL, 
	data JSON NOT NULL, 
	CONSTRAINT pk_events PRIMARY KEY (job_id, sequence), 
	CONSTRAINT fk_events_job_id_jobs FOREIGN KEY(job_id) REFERENCES jobs (id)
);

CREATE TABLE failed_log_ins (
	name VARCHAR NOT NULL, 
	failures INTEGER NOT NULL, 
	last_at DATETIME NOT NULL, 
	CONSTRAINT pk_failed_log_ins PRIMARY KEY (name)
);

CREATE TABLE idempotency_keys (
	"key" VARCHAR NOT NULL, 
	kind VARCHAR NOT NULL, 
	fingerprint VARCHAR NOT NULL, 
	made_id VARCHAR NOT NULL, 
	created_at DATETIME NOT NULL, 
	CONSTRAINT pk_idempotency_keys PRIMARY KEY ("key")
);

CREATE TABLE job_labels (
	job_id VARCHAR NOT NULL, 
	name VARCHAR NOT NULL, 
	value VARCHAR NOT NULL, 
	CONSTRAINT pk_job_labels PRIMARY KEY (job_id, name), 
	CONSTRAINT fk_job_labels_job_id_jobs FOREIGN KEY(job_id) REFERENCES jobs (id)
);

CREATE TABLE jobs (
	id VARCHAR NOT NULL, 
	procedure VARCHAR NOT NULL, 
	procedure_version VARCHAR NOT NULL, 
	unit VARCHAR NOT NULL, 
	bench VARCHAR NOT NULL, 
	state VARCHAR NOT NULL, 
	created_at DATETIME NOT NULL, 
	requested_parameters JSON NOT NULL, 
	parameters JSON NOT NULL, 
	context JSON NOT NULL, 
	stations JSON NOT NULL, 
	duration_s FLOAT NOT NULL, 
	code_version VARCHAR NOT NULL, 
	simulated BOOLEAN NOT NULL, 
	seed BIGINT, 
	priority INTEGER NOT NULL, 
	labels JSON NOT NULL, 
	verdict VARCHAR, 
	stations_done INTEGER NOT NULL, 
	cancel_requested BOOLEAN NOT NULL, 
	started_at DATETIME, 
	finished_at DATETIME, 
	result_id VARCHAR, 
	failure JSON, pause_requested BOOLEAN DEFAULT 0 NOT NULL, attempt INTEGER DEFAULT '1' NOT NULL, deadline_at DATETIME, queued_at DATETIME, not_before DATETIME, retries INTEGER DEFAULT '0' NOT NULL, retries_left INTEGER DEFAULT '0' NOT NULL, reservation VARCHAR, requested_by VARCHAR DEFAULT '' NOT NULL, prompt JSON, mounting VARCHAR, team VARCHAR DEFAULT '' NOT NULL, number INTEGER, 
	CONSTRAINT pk_jobs PRIMARY KEY (id)
);

CREATE TABLE manual_demands (
	id VARCHAR NOT NULL, 
	lease VARCHAR NOT NULL, 
	"key" VARCHAR NOT NULL, 
	kind VARCHAR NOT NULL, 
	"values" JSON NOT NULL, 
	"by" VARCHAR NOT NULL, 
	at DATETIME NOT NULL, 
	state VARCHAR NOT NULL, 
	answer JSON NOT NULL, 
	ended_at DATETIME, 
	CONSTRAINT pk_manual_demands PRIMARY KEY (id), 
	CONSTRAINT uq_manual_demands_lease_key UNIQUE (lease, "key")
);

CREATE TABLE manual_leases (
	id VARCHAR NOT NULL, 
	bench VARCHAR NOT NULL, 
	unit VARCHAR NOT NULL, 
	holder VARCHAR NOT NULL, 
	proven BOOLEAN NOT NULL, 
	reason VARCHAR NOT NULL, 
	created_at DATETIME NOT NULL, 
	until DATETIME NOT NULL, 
	reservation VARCHAR, 
	began_at DATETIME, 
	process VARCHAR NOT NULL, 
	heard INTEGER NOT NULL, 
	end_asked VARCHAR NOT NULL, 
	ended_at DATETIME, 
	ended_because VARCHAR NOT NULL, 
	safe BOOLEAN, 
	CONSTRAINT pk_manual_leases PRIMARY KEY (id)
);

CREATE TABLE mountings (
	id VARCHAR NOT NULL, 
	unit VARCHAR NOT NULL, 
	bench VARCHAR NOT NULL, 
	plate VARCHAR NOT NULL, 
	"by" VARCHAR NOT NULL, 
	proven BOOLEAN NOT NULL, 
	mounted_at DATETIME NOT NULL, 
	entered_at DATETIME NOT NULL, 
	azimuth_deg FLOAT NOT NULL, 
	azimuth_sd_arcsec FLOAT NOT NULL, 
	instrument VARCHAR NOT NULL, 
	remark VARCHAR NOT NULL, 
	ended_at DATETIME, 
	ended_by VARCHAR NOT NULL, 
	CONSTRAINT pk_mountings PRIMARY KEY (id)
);

CREATE TABLE recording_holds (
	id VARCHAR NOT NULL, 
	recording_id VARCHAR NOT NULL, 
	reason VARCHAR NOT NULL, 
	"by" VARCHAR NOT NULL, 
	held_at DATETIME NOT NULL, 
	released_at DATETIME, 
	released_by VARCHAR NOT NULL, 
	CONSTRAINT pk_recording_holds PRIMARY KEY (id), 
	CONSTRAINT fk_recording_holds_recording_id_recordings FOREIGN KEY(recording_id) REFERENCES recordings (id)
);

CREATE TABLE recordings (
	id VARCHAR NOT NULL, 
	unit VARCHAR NOT NULL, 
	bench VARCHAR, 
	job_id VARCHAR, 
	station_index INTEGER, 
	station JSON, 
	channels JSON NOT NULL, 
	rate_hz FLOAT NOT NULL, 
	start_s FLOAT NOT NULL, 
	sample_type VARCHAR NOT NULL, 
	samples BIGINT NOT NULL, 
	chunk_rows INTEGER NOT NULL, 
	chunks INTEGER NOT NULL, 
	stored_bytes BIGINT NOT NULL, 
	content_hash VARCHAR NOT NULL, 
	simulated BOOLEAN NOT NULL, 
	state VARCHAR NOT NULL, 
	created_at DATETIME NOT NULL, 
	source JSON NOT NULL, 
	checkpoint JSON, launched_s FLOAT, measured JSON, raw VARCHAR DEFAULT 'stored' NOT NULL, raw_changed_at DATETIME, archive VARCHAR, station_label VARCHAR, file_names VARCHAR, 
	CONSTRAINT pk_recordings PRIMARY KEY (id), 
	CONSTRAINT fk_recordings_job_id_jobs FOREIGN KEY(job_id) REFERENCES jobs (id)
);

CREATE TABLE reservations (
	id VARCHAR NOT NULL, 
	kind VARCHAR NOT NULL, 
	name VARCHAR NOT NULL, 
	holder VARCHAR NOT NULL, 
	note VARCHAR NOT NULL, 
	created_at DATETIME NOT NULL, 
	until DATETIME NOT NULL, 
	ended_at DATETIME, team VARCHAR DEFAULT '' NOT NULL, 
	CONSTRAINT pk_reservations PRIMARY KEY (id)
);

CREATE TABLE result_calibrations (
	result_id VARCHAR NOT NULL, 
	position INTEGER NOT NULL, 
	calibration_id VARCHAR NOT NULL, 
	CONSTRAINT pk_result_calibrations PRIMARY KEY (result_id, position), 
	CONSTRAINT fk_result_calibrations_calibration_id_calibrations FOREIGN KEY(calibration_id) REFERENCES calibrations (id), 
	CONSTRAINT fk_result_calibrations_result_id_results FOREIGN KEY(result_id) REFERENCES results (id)
);

CREATE TABLE result_contents (
	content VARCHAR NOT NULL, 
	result_id VARCHAR NOT NULL, 
	CONSTRAINT pk_result_contents PRIMARY KEY (content), 
	CONSTRAINT fk_result_contents_result_id_results FOREIGN KEY(result_id) REFERENCES results (id)
);

CREATE TABLE result_corrections (
	result_id VARCHAR NOT NULL, 
	position INTEGER NOT NULL, 
	correction_id VARCHAR NOT NULL, 
	CONSTRAINT pk_result_corrections PRIMARY KEY (result_id, position), 
	CONSTRAINT fk_result_corrections_result_id_results FOREIGN KEY(result_id) REFERENCES results (id), 
	CONSTRAINT fk_result_corrections_correction_id_corrections FOREIGN KEY(correction_id) REFERENCES corrections (id)
);

CREATE TABLE result_quantities (
	result_id VARCHAR NOT NULL, 
	name VARCHAR NOT NULL, 
	value FLOAT NOT NULL, 
	unit VARCHAR NOT NULL, 
	standard_uncertainty FLOAT, 
	CONSTRAINT pk_result_quantities PRIMARY KEY (result_id, name), 
	CONSTRAINT fk_result_quantities_result_id_results FOREIGN KEY(result_id) REFERENCES results (id)
);

CREATE TABLE result_recordings (
	result_id VARCHAR NOT NULL, 
	position INTEGER NOT NULL, 
	recording_id VARCHAR NOT NULL, 
	content_hash VARCHAR NOT NULL, 
	CONSTRAINT pk_result_recordings PRIMARY KEY (result_id, position), 
	CONSTRAINT fk_result_recordings_recording_id_recordings FOREIGN KEY(recording_id) REFERENCES recordings (id), 
	CONSTRAINT fk_result_recordings_result_id_results FOREIGN KEY(result_id) REFERENCES results (id)
);

CREATE TABLE results (
	id VARCHAR NOT NULL, 
	kind VARCHAR NOT NULL, 
	name VARCHAR NOT NULL, 
	version VARCHAR NOT NULL, 
	parameters JSON NOT NULL, 
	document JSON NOT NULL, 
	verdict VARCHAR NOT NULL, 
	code_version VARCHAR NOT NULL, 
	simulated BOOLEAN NOT NULL, 
	created_at DATETIME NOT NULL, 
	unit VARCHAR, 
	job_id VARCHAR, 
	seed BIGINT, 
	context JSON NOT NULL, 
	CONSTRAINT pk_results PRIMARY KEY (id), 
	CONSTRAINT fk_results_job_id_jobs FOREIGN KEY(job_id) REFERENCES jobs (id)
);

CREATE TABLE schedules (
	id VARCHAR NOT NULL, 
	campaign VARCHAR NOT NULL, 
	enabled BOOLEAN NOT NULL, 
	created_at DATETIME NOT NULL, 
	next_at DATETIME, 
	last_at DATETIME, 
	document JSON NOT NULL, 
	CONSTRAINT pk_schedules PRIMARY KEY (id)
);

CREATE TABLE sessions (
	digest VARCHAR NOT NULL, 
	account VARCHAR NOT NULL, 
	created_at DATETIME NOT NULL, 
	last_used_at DATETIME NOT NULL, 
	CONSTRAINT pk_sessions PRIMARY KEY (digest)
);

CREATE TABLE tokens (
	id VARCHAR NOT NULL, 
	name VARCHAR NOT NULL, 
	role VARCHAR NOT NULL, 
	team VARCHAR NOT NULL, 
	digest VARCHAR NOT NULL, 
	created_at DATETIME NOT NULL, 
	created_by VARCHAR NOT NULL, 
	expires_at DATETIME NOT NULL, 
	revoked_at DATETIME, 
	last_used_at DATETIME, 
	CONSTRAINT pk_tokens PRIMARY KEY (id)
);

CREATE TABLE unit_notes (
	id VARCHAR NOT NULL, 
	unit VARCHAR NOT NULL, 
	at DATETIME NOT NULL, 
	"by" VARCHAR NOT NULL, 
	proven BOOLEAN NOT NULL, 
	text VARCHAR NOT NULL, 
	CONSTRAINT pk_unit_notes PRIMARY KEY (id)
);

CREATE TABLE units (
	serial VARCHAR NOT NULL, 
	document JSON NOT NULL, 
	updated_at DATETIME NOT NULL, 
	CONSTRAINT pk_units PRIMARY KEY (serial)
);

CREATE TABLE upkeep (
	id VARCHAR NOT NULL, 
	kind VARCHAR NOT NULL, 
	began_at DATETIME NOT NULL, 
	ended_at DATETIME, 
	"by" VARCHAR NOT NULL, 
	good BOOLEAN, 
	document JSON NOT NULL, 
	CONSTRAINT pk_upkeep PRIMARY KEY (id)
);

CREATE INDEX ix_analysis_task_recordings_recording_id ON analysis_task_recordings (recording_id);

CREATE INDEX ix_analysis_tasks_batch_id_state ON analysis_tasks (batch_id, state);

CREATE INDEX ix_analysis_tasks_state_priority_batch_id_number ON analysis_tasks (state, priority, batch_id, number);

CREATE UNIQUE INDEX ix_audit_sequence ON audit (sequence);

CREATE INDEX ix_bench_stops_bench_id ON bench_stops (bench, id);

CREATE INDEX ix_bench_stops_standing ON bench_stops (bench) WHERE released_at IS NULL;

CREATE INDEX ix_calibration_decisions_calibration_id_id ON calibration_decisions (calibration_id, id);

CREATE INDEX ix_calibrations_unit_id ON calibrations (unit, id);

CREATE INDEX ix_campaign_runs_campaign_id ON campaign_runs (campaign, id);

CREATE INDEX ix_campaign_runs_state_id ON campaign_runs (state, id);

CREATE INDEX ix_correction_decisions_correction_id_id ON correction_decisions (correction_id, id);

CREATE INDEX ix_corrections_unit_id ON corrections (unit, id);

CREATE INDEX ix_job_labels_name_job_id ON job_labels (name, job_id);

CREATE INDEX ix_job_labels_name_value_job_id ON job_labels (name, value, job_id);

CREATE INDEX ix_jobs_bench_id ON jobs (bench, id);

CREATE INDEX ix_jobs_bench_state_priority_queued_at_id ON jobs (bench, state, priority, queued_at, id);

CREATE INDEX ix_jobs_finished_at_id ON jobs (finished_at, id);

CREATE INDEX ix_jobs_id_procedure_unit_bench_requested_by ON jobs (id, procedure, unit, bench, requested_by);

CREATE UNIQUE INDEX ix_jobs_number ON jobs (number);

CREATE INDEX ix_jobs_procedure_id ON jobs (procedure, id);

CREATE INDEX ix_jobs_requested_by_id ON jobs (requested_by, id);

CREATE INDEX ix_jobs_result_id_id ON jobs (result_id, id);

CREATE INDEX ix_jobs_state_id ON jobs (state, id);

CREATE INDEX ix_jobs_unit_id ON jobs (unit, id);

CREATE INDEX ix_jobs_verdict_id ON jobs (verdict, id);

CREATE INDEX ix_manual_demands_lease_id ON manual_demands (lease, id);

CREATE INDEX ix_manual_leases_bench_id ON manual_leases (bench, id);

CREATE UNIQUE INDEX ix_manual_leases_open ON manual_leases (bench) WHERE ended_at IS NULL;

CREATE INDEX ix_mountings_bench_id ON mountings (bench, id);

CREATE INDEX ix_mountings_unit_id ON mountings (unit, id);

CREATE INDEX ix_recording_holds_recording_id ON recording_holds (recording_id);

CREATE INDEX ix_recordings_bench_id ON recordings (bench, id);

CREATE INDEX ix_recordings_file_names_id ON recordings (file_names, id) WHERE length(file_names) <= 500;

CREATE INDEX ix_recordings_job_id_id ON recordings (job_id, id);

CREATE INDEX ix_recordings_long_file_names ON recordings (id) WHERE length(file_names) > 500;

CREATE INDEX ix_recordings_long_station_label ON recordings (id) WHERE length(station_label) > 500;

CREATE INDEX ix_recordings_raw_state_stored_bytes ON recordings (raw, state, stored_bytes);

CREATE INDEX ix_recordings_simulated_id ON recordings (simulated, id);

CREATE INDEX ix_recordings_state_stored_bytes ON recordings (state, stored_bytes);

CREATE INDEX ix_recordings_station_label_id ON recordings (station_label, id) WHERE length(station_label) <= 500;

CREATE INDEX ix_recordings_unit_id ON recordings (unit, id);

CREATE INDEX ix_reservations_kind_name ON reservations (kind, name);

CREATE INDEX ix_result_calibrations_calibration_id ON result_calibrations (calibration_id);

CREATE INDEX ix_result_corrections_correction_id ON result_corrections (correction_id);

CREATE INDEX ix_result_recordings_recording_id ON result_recordings (recording_id);

CREATE INDEX ix_results_id_name_unit_job_id ON results (id, name, unit, job_id);

CREATE INDEX ix_results_job_id_id ON results (job_id, id);

CREATE INDEX ix_results_name_id ON results (name, id);

CREATE INDEX ix_results_unit_id ON results (unit, id);

CREATE INDEX ix_results_unit_name_simulated_id ON results (unit, name, simulated, id, job_id, created_at, code_version);

CREATE INDEX ix_results_verdict_id ON results (verdict, id);

CREATE INDEX ix_sessions_account ON sessions (account);

CREATE UNIQUE INDEX ix_tokens_digest ON tokens (digest);

CREATE INDEX ix_tokens_name ON tokens (name);

CREATE INDEX ix_unit_notes_unit_id ON unit_notes (unit, id);

CREATE INDEX ix_upkeep_kind_id ON upkeep (kind, id);

CREATE UNIQUE INDEX uq_calibrations_current_unit_triad ON calibrations (unit, triad) WHERE is_current;

CREATE UNIQUE INDEX uq_calibrations_result_triad ON calibrations (result_id, triad);

CREATE UNIQUE INDEX uq_corrections_current_unit_kind ON corrections (unit, kind) WHERE is_current;

CREATE UNIQUE INDEX uq_recordings_complete_station ON recordings (job_id, station_index) WHERE state = 'complete';

INSERT INTO "access_state" VALUES ('access', 0, '{a new secret}');

INSERT INTO "alembic_version" VALUES ('0023');

